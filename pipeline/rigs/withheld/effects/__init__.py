"""Planted effects, by kind."""
