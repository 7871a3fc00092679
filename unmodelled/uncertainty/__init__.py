"""Distributions of uncertain parameters: families, propagation to outputs, likelihood; functions and arrays.

May import: base.
"""
