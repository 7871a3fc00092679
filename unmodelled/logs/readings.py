"""Match outputs with the states that they show."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import sympy as sp

from unmodelled.systems.model import System


@dataclass(frozen=True)
class Reading:
    """State that an output shows as gain * state + offset, or that is the derivative of such a state.

    Attributes:
        state: index of the state.
        output: index of the output.
        gain: factor in front of the state, in terms of parameters and constants of the operating point.
        offset: summand beside it, in the same terms and inputs.
        slope: True where the state is the time derivative of what the output shows.
    """

    state: int
    output: int
    gain: sp.Expr
    offset: sp.Expr
    slope: bool = False

    @property
    def plain(self) -> bool:
        """Whether the output, or its derivative, is the state itself."""
        return bool(self.gain == 1 and self.offset == 0)


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
                found.setdefault(v, Reading(v, shown.output, shown.gain, sp.S.Zero, slope=True))
    return tuple(found[k] for k in sorted(found))


def _reading(system: System, j: int) -> Reading | None:
    expression = system.outputs[j].expression
    seen = expression.free_symbols & set(system.x)
    if len(seen) != 1 or not expression.free_symbols <= {*seen, *system.u, *system.p, *system.c}:
        return None
    (state,) = seen
    gain = sp.diff(expression, state)
    offset = sp.expand(expression - gain * state)
    if gain.has(state, *system.u) or offset.has(state):
        return None
    return Reading(system.x.index(state), j, gain, offset)
