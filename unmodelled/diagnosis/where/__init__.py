"""The place of the gap: channels, regions of operation, factors and experiments."""
