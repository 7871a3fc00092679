"""Event times of many samples of a system's parameters, side by side, from generated code."""
