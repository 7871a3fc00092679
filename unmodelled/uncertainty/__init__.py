"""Distributions of uncertain parameters: propagation to the outputs, and identification from data."""
