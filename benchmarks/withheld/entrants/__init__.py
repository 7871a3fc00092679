"""Entrants of the benchmark beside the diagnosis: an example in plain Python, and methods of others."""
