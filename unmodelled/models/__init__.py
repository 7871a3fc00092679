"""Models of the dynamics: known physics plus efforts, one file per family."""
