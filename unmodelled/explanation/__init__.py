"""Identifiability of parameters, and closed forms of learned forces."""
