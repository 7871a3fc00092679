"""A first mapping and a first system file, guessed from logs.

May import: base, systems, logs.
"""
