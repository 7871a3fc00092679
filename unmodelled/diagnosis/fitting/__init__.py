"""Fits of models to recordings by free runs, the gap, and predictions of left-out experiments."""
