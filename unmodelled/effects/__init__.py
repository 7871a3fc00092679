"""Effects that models of machines leave out (friction, backlash, delay, ...), one family per file."""
