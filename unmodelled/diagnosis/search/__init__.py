"""Which effects explain the gap: screening, choosing, confidence, and faults of the logs."""
