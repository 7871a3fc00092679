"""Inputs of a diagnosis (recordings, sensors, thresholds), and its result."""
