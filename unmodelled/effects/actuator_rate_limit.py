"""Limit of the rate of an actuator, alone or with a lag behind it."""

from unmodelled.effects.effect import DriveEffect
from unmodelled.effects.grids import geometric, relaxation
from unmodelled.effects.law import Law, Memory, Shape, share
from unmodelled.effects.place import Site

#: Number of limits that are tried. The slowest crosses half the range of the input within this part of the
#: longest experiment, the fastest within this number of samples.
_LIMITS, _SLOWEST, _FASTEST = 7, 0.5, 4.0
#: Numbers of limits and of time constants that are tried of a limit with a lag behind it.
_EACH = 4


class ActuatorRateLimit(DriveEffect):
    """Actuator that follows its input with a limited rate.

    Close to its input the actuator follows within one sampling period, so that a simulation stays stable.
    """

    family = "actuator_rate_limit"

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


class RampAndLag(DriveEffect):
    """Actuator that follows its input with a limited rate, and behind the limit with a first-order lag.

    Firmware of drives limits the ramp of a command, and filters what the ramp gives. Both begin at zero with
    every experiment, as where the drive is switched on.
    """

    family = "actuator_rate_limit"
    variant = "with_lag"
    says = "rate limit of {r_u} behind a lag of {T_u}"

    def law(self, at: Site) -> Law:
        half = at["u"].half
        rates = geometric(half / (_SLOWEST * at.duration), half / (_FASTEST * at.period), _EACH)
        times = geometric(2.0 * at.period, 0.05 * at.duration, _EACH)
        shapes = {
            "r_u": Shape("u/t", rates, (0.1 * rates[0], 10.0 * rates[-1])),
            "T_u": Shape("t", times, (0.5 * at.period, at.duration)),
        }
        memory = {
            "u_r": Memory("u", "r_u*tanh((u - u_r)/(r_u*tau))"),
            "u_f": Memory("u", "(u_r - u_f)/T_u"),
        }
        text = "u_f, T_u*d(u_f)/dt = u_r - u_f, abs(d(u_r)/dt) <= r_u"
        return Law(text, {"c_u": share("u_f - u")}, shapes, {"tau": relaxation(at)}, memory)
