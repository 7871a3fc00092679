"""How far a model is off on experiments that it has not seen, and which these are."""
