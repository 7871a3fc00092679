"""Match outputs with the states that they show."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import sympy as sp

from unmodelled.systems.model import System


@dataclass(frozen=True)
class Reading:
    """State that an output shows as gain * state + offset, or that is the derivative of such a state.

    An output that shows a low-pass filtered quantity y_f shows the quantity as y_f + lag * d(y_f)/dt.

    Attributes:
        state: index of the state.
        output: index of the output.
        gain: factor in front of the state, in terms of parameters and constants of the operating point.
        offset: summand beside it, in the same terms and inputs.
        slope: True where the state is the time derivative of what the output shows.
        lag: time constant of a low-pass filter between the state and the output, in terms of parameters;
            default 0: there is no filter.
    """

    state: int
    output: int
    gain: sp.Expr
    offset: sp.Expr
    slope: bool = False
    lag: sp.Expr = sp.S.Zero

    @property
    def plain(self) -> bool:
        """Whether the output, or its derivative, is the state itself."""
        return bool(self.gain == 1 and self.offset == 0 and self.lag == 0)


def readings(system: System, usable: Callable[[Reading], bool] = lambda _: True) -> tuple[Reading, ...]:
    """Return all states that outputs show, in the order of the states.

    An output that is a state goes before one that is a function of it.

    Args:
        system: system whose states and outputs are compared.
        usable: function that tells whether a reading of an output may be used; default: all may.
    """
    found: dict[int, Reading] = {}
    outputs = range(len(system.outputs))
    for j in sorted(outputs, key=lambda j: system.outputs[j].expression not in system.x):
        reading = _reading(system, j)
        if reading is not None and reading.state not in found and usable(reading):
            found[reading.state] = reading
    for k, shown in list(found.items()):
        if system.dynamics[k] in system.x:
            v = system.x.index(system.dynamics[k])
            if not shown.offset.free_symbols & set(system.u):
                found.setdefault(v, Reading(v, shown.output, shown.gain, sp.S.Zero, True, shown.lag))
    return tuple(found[k] for k in sorted(found))


def _reading(system: System, j: int) -> Reading | None:
    expression, lag = _unfiltered(system, system.outputs[j].expression)
    seen = expression.free_symbols & set(system.x)
    if len(seen) != 1 or not expression.free_symbols <= {*seen, *system.u, *system.p, *system.c}:
        return None
    (state,) = seen
    gain = sp.diff(expression, state)
    offset = sp.expand(expression - gain * state)
    if gain.has(state, *system.u) or offset.has(state):
        return None
    if lag != 0 and offset.free_symbols & set(system.u):
        return None
    return Reading(system.x.index(state), j, gain, offset, lag=lag)


def _unfiltered(system: System, expression: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
    """Return the expression of an output without a low-pass filter, and the time constant of the filter.

    A filtered output is gain * (y + c*(z - y)) + offset. The state z has the derivative (y - z)/T, and c is 1
    with the filter and 0 without it, so that the time constant is c*T. The quantity y shows one other state.
    """
    seen = expression.free_symbols & set(system.x)
    for z in seen if len(seen) == 2 else ():
        (x,) = seen - {z}
        rate = system.dynamics[system.x.index(z)]
        pole, weight = sp.diff(rate, z), sp.diff(expression, z)
        if pole == 0 or not (pole.free_symbols | weight.free_symbols) <= {*system.p, *system.c}:
            continue
        y = sp.expand(z - rate / pole)
        whole = sp.expand(expression.xreplace({z: y}))
        inner, gain = sp.diff(y, x), sp.diff(whole, x)
        if z not in whole.free_symbols and inner != 0 and gain != 0:
            return whole, sp.cancel(-weight * inner / (gain * pole))
    return expression, sp.S.Zero
