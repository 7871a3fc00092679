"""Command line: `unmodelled <verb> key=value ...`."""
