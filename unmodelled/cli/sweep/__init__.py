"""The runs of a sweep, read back: what each was given and what it left."""
