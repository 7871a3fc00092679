"""Free runs of many systems at once, as programs of a register machine."""
