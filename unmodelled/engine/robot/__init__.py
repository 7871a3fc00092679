"""Robots in MuJoCo: what their files cannot say, and free runs along logs."""
