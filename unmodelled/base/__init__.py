"""Basics of every room: bad input, files, progress, processes, compiled functions."""
