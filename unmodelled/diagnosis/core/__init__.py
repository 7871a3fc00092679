"""Everything that could be wrong with a model as columns of one linear system around the measured path."""
