"""What everything stands on: bad input, files, progress, processes, compiled functions."""
