"""A mass, or moment of inertia, that is not the known one."""

from __future__ import annotations

from pipeline.physics.effects.effect import PortEffect
from pipeline.physics.effects.law import Amplitude, Law
from pipeline.physics.effects.motion import is_inertial
from pipeline.physics.effects.place import Site
from pipeline.physics.system.model import Port, System

#: Of the mass that the port feels: how much may be missing, or be there besides.
_LEAST, _MOST = -0.95, 20.0


class InertiaError(PortEffect):
    """In proportion to the acceleration of the port."""

    family = "inertia_error"
    complexity = 1.5
    needs = ("velocity",)
    power = "stored"

    def suits(self, system: System, port: Port) -> bool:
        return super().suits(system, port) and is_inertial(system, port)

    def law(self, at: Site) -> Law:
        mass = 1.0 / at.mobility
        return Law("dM*d(v)/dt", {"dM": Amplitude("a", 0.1 * mass, (_LEAST * mass, _MOST * mass))})
