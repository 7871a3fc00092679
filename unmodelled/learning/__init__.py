"""Networks as forces of a system, their training and formulas; distributions identified from logs.

May import: base, systems, effects, engine, logs, uncertainty.
"""
