"""Splits, metrics and the boundary between contact and jumps."""
