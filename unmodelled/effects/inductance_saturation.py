"""Saturation of the iron core of a coil."""

from unmodelled.effects.coil import CoilEffect
from unmodelled.effects.grids import inside
from unmodelled.effects.law import Amplitude, Law, Shape
from unmodelled.effects.place import Site

#: Of the inductance that the port feels: how much of it may vanish at high currents.
_MOST = 0.95


class InductanceSaturation(CoilEffect):
    """Inductance that falls with the current, from its value in the system file to less."""

    kind = "number"
    family = "inductance_saturation"
    says = "inductance that falls by {L_s} beyond {i_s}"
    needs = ("velocity", "mass")
    power = "stored"

    def law(self, at: Site) -> Law:
        inductance, most = 1.0 / at.mobility, max(abs(at["v"].low), at["v"].high)
        share = "(v/i_s)**2/(1 + (v/i_s)**2)"
        return Law(
            f"-L_s*{share}*d(v)/dt",
            {"L_s": Amplitude(f"-{share}*a", 0.1 * inductance, (0.0, _MOST * inductance))},
            {"i_s": Shape("v", inside(0.0, 1.5 * most, 4), (0.02 * most, 3.0 * most))},
        )
