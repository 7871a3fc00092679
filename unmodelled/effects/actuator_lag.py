"""Lag of an actuator behind its input."""

from collections.abc import Mapping

from unmodelled.effects.added import Added
from unmodelled.effects.effect import USUAL_PERIODS, DriveEffect
from unmodelled.effects.grids import geometric
from unmodelled.effects.law import Fixed, Law, Memory, Shape, share
from unmodelled.effects.place import Site


class ActuatorLag(DriveEffect):
    """First-order lag of the actuator.

    One that is shorter than a sample, which steps of the integration can hardly follow, is a part of a lag of
    a sample: it delays as much, and can be nothing.
    """

    kind = "timing"
    family = "actuator_lag"

    def usual(self, added: Added, period: float) -> Mapping[str, float]:
        return dict.fromkeys(added.shapes, USUAL_PERIODS * period)

    def law(self, at: Site) -> Law:
        grid = geometric(at.period, 0.1 * at.duration, 6)
        return Law(
            "u_f, T_u*d(u_f)/dt = u - u_f",
            {"c_u": share("(u_f - u)*min(1, T_u/T_s)")},
            {"T_u": Shape("t", grid, (0.0, at.duration))},
            {"T_s": Fixed("t", at.period)},
            memory={"u_f": Memory("u", "(u - u_f)/max(T_u, T_s)", start="u")},
            # one lag behind another is said as a single one of the same delay
            robot={"timeconst": "timeconst + T_u"},
        )
