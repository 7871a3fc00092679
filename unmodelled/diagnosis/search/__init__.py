"""The search for effects that explain the gap (screening, then fits), and for faults of the logs."""
