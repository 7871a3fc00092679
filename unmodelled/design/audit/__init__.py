"""Several sets of numbers of one system beside logs: what is determined, absorbed and contradicted."""
