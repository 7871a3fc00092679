"""Effects that a model can leave out (friction, backlash, ...), one law per file, and where they can act.

May import: base, systems.
"""
