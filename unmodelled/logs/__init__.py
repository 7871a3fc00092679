"""Measurements of a system: log folders, read into arrays on one uniform clock."""
