"""Lag of an actuator behind its input."""

from collections.abc import Mapping

from unmodelled.effects.added import Added
from unmodelled.effects.effect import USUAL_PERIODS, DriveEffect
from unmodelled.effects.grids import geometric
from unmodelled.effects.law import Law, Memory, Shape, share
from unmodelled.effects.place import Site


class ActuatorLag(DriveEffect):
    """First-order lag of the actuator."""

    kind = "timing"
    family = "actuator_lag"

    def usual(self, added: Added, period: float) -> Mapping[str, float]:
        return dict.fromkeys(added.shapes, USUAL_PERIODS * period)

    def law(self, at: Site) -> Law:
        grid = geometric(at.period, 0.1 * at.duration, 6)
        return Law(
            "u_f, T_u*d(u_f)/dt = u - u_f",
            {"c_u": share("u_f - u")},
            {"T_u": Shape("t", grid, (0.5 * at.period, at.duration))},
            memory={"u_f": Memory("u", "(u - u_f)/T_u", start="u")},
            # one lag behind another is said as a single one of the same delay
            robot={"timeconst": "timeconst + T_u"},
        )
