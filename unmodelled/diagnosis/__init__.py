"""Diagnosis of the gap between a model and measured experiments: effects that the model leaves out.

May import: base, systems, effects, engine, logs.
"""
