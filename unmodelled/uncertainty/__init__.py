"""Uncertain parameters: polynomial chaos, densities of the outputs, and what identifies the parameters."""
