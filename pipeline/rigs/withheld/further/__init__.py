"""Further virtual machines, which have cases of their own."""
