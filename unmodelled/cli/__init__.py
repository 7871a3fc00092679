"""The command `unmodelled`: verbs as thin wrappers of functions, keys and overrides, refusals, sweeps.

May import: base, uncertainty, drafting, learning, report, api.
"""
