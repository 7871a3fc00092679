"""Pages, tables and figures of results, from files; models are unknown here.

May import: base, systems.
"""
