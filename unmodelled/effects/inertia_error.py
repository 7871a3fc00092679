"""Error of a known mass or moment of inertia."""

from unmodelled.effects.effect import PortEffect
from unmodelled.effects.law import Amplitude, Law, signed
from unmodelled.effects.place import Site

#: Of the mass that the port feels: how much may be missing, or be there besides.
_LEAST, _MOST = -0.95, 20.0
_SAID = {"armature": "armature + dM"}


class InertiaError(PortEffect):
    """Error of the mass: an effort proportional to the acceleration of the port."""

    kind = "number"
    family = "inertia_error"
    says = "inertia off by {dM}"
    needs = ("velocity", "mass")
    power = "stored"

    def law(self, at: Site) -> Law:
        return Law("dM*d(v)/dt", {"dM": _mass(at)}, robot=_SAID)


class MassWithItsWeight(PortEffect):
    """Error of the mass of a port that moves up or down, together with the weight of that mass."""

    kind = "number"
    family = "inertia_error"
    variant = "with_weight"
    says = "mass off by {dM}, with a weight of {F_g}"
    needs = ("velocity", "mass")

    def law(self, at: Site) -> Law:
        amplitudes = {"dM": _mass(at), "F_g": signed("1", at.effort)}
        return Law("dM*d(v)/dt + F_g", amplitudes, robot=_SAID)


def _mass(at: Site) -> Amplitude:
    mass = 1.0 / at.mobility
    return Amplitude("a", 0.1 * mass, (_LEAST * mass, _MOST * mass))
