"""Inputs of a diagnosis (recordings, sensors, options), and its result."""
