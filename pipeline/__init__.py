"""The dissertation on the library `unmodelled`, as a pipeline of stages."""
