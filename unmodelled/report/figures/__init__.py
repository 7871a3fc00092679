"""Figures of a diagnosis; their tables are in the same folder of results."""
