"""Resistance of a winding that grows as its current heats it."""

from unmodelled.effects.coil import CoilEffect
from unmodelled.effects.grids import geometric
from unmodelled.effects.law import Law, Memory, Shape, positive
from unmodelled.effects.place import Site

#: Of the longest experiment: the fastest and the slowest time constant of the starts, and the slowest of all.
_FAST, _SLOW, _SLOWEST = 0.03, 3.0, 30.0


class SelfHeating(CoilEffect):
    """Resistance that grows with the heat of the current: one thermal time constant, cold at the start.

    The temperature follows the square of the current, and the resistance of copper grows by 0.39 % per K
    (Hughes and Drury, Electric Motors and Drives, 2019).
    """

    kind = "number"
    family = "self_heating"
    says = "self-heating with a time constant of {tau_h}"
    power = "lost"

    def law(self, at: Site) -> Law:
        grid = geometric(_FAST * at.duration, _SLOW * at.duration, 4)
        return Law(
            "k_h*w*v, tau_h*d(w)/dt = v**2 - w",
            {"k_h": positive("w*v", at.effort / at["v"].rms ** 3)},
            {"tau_h": Shape("t", grid, (0.3 * grid[0], _SLOWEST * at.duration))},
            memory={"w": Memory("v**2", "(v**2 - w)/tau_h")},
        )
