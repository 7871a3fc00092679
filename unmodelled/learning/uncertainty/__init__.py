"""Inverse uncertainty identification: which distribution of the parameters explains the observed outputs."""
