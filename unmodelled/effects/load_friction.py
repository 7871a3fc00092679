"""Dry friction that grows with the effort that a gear, a screw or a guide transmits."""

from unmodelled.effects.effect import PortEffect
from unmodelled.effects.grids import creep
from unmodelled.effects.law import Amplitude, Law
from unmodelled.effects.place import Site

#: Largest share of the load that friction takes: with friction as large as the load, nothing would move.
MOST = 0.9


class OfLoad(PortEffect):
    """Friction at a port whose load is known."""

    kind = "dry friction"
    family = "load_friction"
    needs = ("velocity", "load")
    power = "lost"


def _of_load(at: Site, adds: str) -> Amplitude:
    """Share of the load that friction takes."""
    return Amplitude(adds, min(at.effort / at["l"].rms, MOST), (0.0, MOST))


class LoadFriction(OfLoad):
    """Dry friction in proportion to the magnitude of the load."""

    def law(self, at: Site) -> Law:
        amplitudes = {"k_l": _of_load(at, "abs(l)*tanh(v/v_c)")}
        return Law("k_l*abs(l)*sign(v)", amplitudes, {"v_c": creep(at)})


class LoadFrictionByDirection(OfLoad):
    """Friction in proportion to the load, with another share where the load drives the motion and where not.

    A gear has one efficiency when the motor drives it and another one when it is driven back.
    """

    variant = "by_direction"
    says = "friction of {k_d} of the load where it drives and {k_b} where it brakes"

    def law(self, at: Site) -> Law:
        amplitudes = {
            "k_d": _of_load(at, "where(l*v > 0, abs(l)*tanh(v/v_c), 0)"),
            "k_b": _of_load(at, "where(l*v > 0, 0, abs(l)*tanh(v/v_c))"),
        }
        return Law("where(l*v > 0, k_d, k_b)*abs(l)*sign(v)", amplitudes, {"v_c": creep(at)})
