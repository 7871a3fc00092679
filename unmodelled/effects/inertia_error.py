"""Error of a known mass or moment of inertia."""

from __future__ import annotations

from unmodelled.effects.effect import PortEffect
from unmodelled.effects.law import Amplitude, Law, signed
from unmodelled.effects.motion import is_inertial
from unmodelled.effects.place import Site
from unmodelled.systems.model import Port, System

#: Of the mass that the port feels: how much may be missing, or be there besides.
_LEAST, _MOST = -0.95, 20.0
_SAID = {"armature": "armature + dM"}


class _InertiaError(PortEffect):
    family = "inertia_error"
    needs = ("velocity",)

    def suits(self, system: System, port: Port) -> bool:
        return super().suits(system, port) and is_inertial(system, port)


class InertiaError(_InertiaError):
    """Error of the mass: an effort proportional to the acceleration of the port."""

    complexity = 1.5
    power = "stored"

    def law(self, at: Site) -> Law:
        return Law("dM*d(v)/dt", {"dM": _mass(at)}, robot=_SAID)


class MassWithItsWeight(_InertiaError):
    """Error of the mass of a port that moves up or down, together with the weight of that mass."""

    variant = "with_weight"
    complexity = 2.2

    def law(self, at: Site) -> Law:
        amplitudes = {"dM": _mass(at), "F_g": signed("1", at.effort)}
        return Law("dM*d(v)/dt + F_g", amplitudes, robot=_SAID)


def _mass(at: Site) -> Amplitude:
    mass = 1.0 / at.mobility
    return Amplitude("a", 0.1 * mass, (_LEAST * mass, _MOST * mass))
