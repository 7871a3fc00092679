"""Looks at logs without a model: faults of single channels, which are cured where that is safe."""
