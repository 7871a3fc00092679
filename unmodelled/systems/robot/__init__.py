"""Robots from URDF and MJCF files: a tree of bodies, and its equations of motion as procedures."""
