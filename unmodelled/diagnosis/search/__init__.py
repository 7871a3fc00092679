"""The search for effects that explain the gap (linear systems, then fits), and for faults of the logs."""
