"""Measured experiments on one uniform clock: recorders' files, checks, looks at faults, estimated states.

May import: base, systems, engine.
"""
