"""Limit of the rate of an actuator."""

from unmodelled.effects.effect import DriveEffect
from unmodelled.effects.grids import geometric, relaxation
from unmodelled.effects.law import Law, Memory, Shape, share
from unmodelled.effects.place import Site

#: Number of limits that are tried. The slowest crosses half the range of the input within this part of the
#: longest experiment, the fastest within this number of samples.
_LIMITS, _SLOWEST, _FASTEST = 7, 0.5, 4.0


class ActuatorRateLimit(DriveEffect):
    """Actuator that follows its input with a limited rate.

    Close to its input the actuator follows within one sampling period, so that a simulation stays stable.
    """

    family = "actuator_rate_limit"
    complexity = 2.0

    def law(self, at: Site) -> Law:
        half = at["u"].half
        grid = geometric(half / (_SLOWEST * at.duration), half / (_FASTEST * at.period), _LIMITS)
        return Law(
            "u_f, abs(d(u_f)/dt) <= r_u",
            {"c_u": share("u_f - u")},
            {"r_u": Shape("u/t", grid, (0.1 * grid[0], 10.0 * grid[-1]))},
            {"tau": relaxation(at)},
            {"u_f": Memory("u", "r_u*tanh((u - u_f)/(r_u*tau))", start="u")},
        )
