"""What logs can determine, and which experiment would determine more: identifiability, search, plans.

May import: base, systems, effects, engine, logs, diagnosis.
"""
