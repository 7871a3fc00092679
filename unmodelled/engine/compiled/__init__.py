"""Compiled rollouts of a system with networks in its ports, generated from its symbolic equations."""
