"""Functions and results of `import unmodelled`: rooms that compute, joined with those that draw."""
