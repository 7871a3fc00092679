"""Virtual machines with planted effects, on which the diagnosis of the sim-to-real gap is judged.

They share no code with the system files, the effect laws or the integrators that the diagnosis uses. A
machine is stepped by the scheme of Moreau and Jean, which knows dry friction, play and impacts as set-valued
laws.
"""
