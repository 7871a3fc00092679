"""The judge: laws compared by their evidence on long windows, beside a chain that every log has."""
