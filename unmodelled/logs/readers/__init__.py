"""Readers of the files that recorders write, one format per file."""
