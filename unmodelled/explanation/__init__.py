"""What a model and its data can tell, and what they cannot."""
