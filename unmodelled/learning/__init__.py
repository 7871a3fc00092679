"""Fitting models to trajectories; nothing here knows a particular split or figure."""
