"""Virtual machines with planted effects, which show how often a diagnosis is right.

The machines share no code with the system files, the laws or the integrators of the diagnosis. A machine is
integrated by the scheme of Moreau and Jean, in which dry friction, play and impacts are set-valued laws.
"""
