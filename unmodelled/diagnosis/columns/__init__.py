"""Columns: how small changes of numbers, laws and starts move the errors of a free run."""
