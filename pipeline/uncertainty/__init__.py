"""Compare methods that propagate a parameter distribution with samples and exact densities (section 3.4)."""
