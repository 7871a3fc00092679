"""What a diagnosis says: its result, sentences, tables and the augmented system."""
