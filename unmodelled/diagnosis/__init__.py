"""What the gap between a model and measured experiments is made of."""
