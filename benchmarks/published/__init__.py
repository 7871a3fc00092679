"""Simulation errors on the official tests of public data sets: of a diagnosis, and of black boxes."""
