"""Free runs of a system: register machine, compiled kernels with gradients, event times, robots in MuJoCo.

May import: base, systems.
"""
