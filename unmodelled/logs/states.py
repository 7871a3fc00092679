"""The states of a system along measured experiments: read, differentiated, or integrated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from unmodelled.engine.differentiate import smooth_derivative
from unmodelled.logs.clock import shifted
from unmodelled.logs.observer import integrated
from unmodelled.systems.model import Output, System
from unmodelled.systems.numeric import numpy_system_function

Array = NDArray[np.float64]
Offsets = NDArray[np.int64]


@dataclass(frozen=True)
class States:
    """Estimated states.

    Attributes:
        x: (M, states).
        measured: per state, whether an output shows it, or it is the velocity of a position that one shows.
        notes: how states that are not simply read were obtained.
    """

    x: Array
    measured: tuple[bool, ...]
    notes: tuple[str, ...]


def estimate(
    system: System, ids: Sequence[str], period: float, offsets: Offsets, y: Array, u: Array, c: Array
) -> States:
    """States of `system` along experiments on a uniform clock.

    A state that an output shows, as itself or times and plus constants, is that output's column. The velocity
    of such a position is its smoothed derivative. Both are read later by the output's delay, and held at the
    end where the log has no later samples. Every other state is integrated from its initial value with these
    imposed.

    Args:
        system: whose states.
        ids: of the n experiments.
        period: sampling period, s.
        offsets: (n + 1,) experiment `i` owns the samples `offsets[i]:offsets[i + 1]`.
        y: (M, outputs) as logged. u: (M, inputs) as they act. c: (n, constants).

    Raises:
        BadInput: when an integrated state diverges.
    """
    x = np.zeros((offsets[-1], len(system.states)))
    shown: dict[int, Output] = {}
    notes: list[str] = []
    constants = np.repeat(c, np.diff(offsets), axis=0)
    for j in sorted(range(len(system.outputs)), key=lambda j: system.outputs[j].expression not in system.x):
        output = system.outputs[j]
        reading = _reading(system, output, y[:, j], constants)
        if reading is None or reading[0] in shown:
            continue
        k, x[:, k] = reading
        shown[k] = output
        if output.expression != system.x[k]:
            notes.append(f"{system.states[k].name} was read from {output.name} = {output.expression}")
    for k in list(shown):
        v = _index(system, system.dynamics[k])
        if v is not None and v not in shown:
            _, x[:, v], width = smooth_derivative(x[:, k], offsets, period)
            shown[v] = shown[k]
            notes.append(
                f"{system.states[v].name} was estimated from {system.states[k].name} by smoothing "
                f"differentiation over {width} samples"
            )
    _undelay(x, shown, period, offsets)
    held = {o.name: o.delay for o in shown.values() if o.delay > 0.0}
    notes += [
        f"what {name} shows is held over the last {delay:g} s, its delay" for name, delay in held.items()
    ]
    unknown = [k for k in range(len(system.states)) if k not in shown]
    if unknown:
        x[:, unknown] = integrated(system, unknown, ids, period, offsets, x, u, c)
        names = ", ".join(system.states[k].name for k in unknown)
        notes.append(f"{names}: no output shows it, integrated from the start of each experiment")
    return States(x, tuple(k in shown for k in range(len(system.states))), tuple(notes))


def _reading(system: System, output: Output, y: Array, constants: Array) -> tuple[int, Array] | None:
    """Which state an output shows, and its values (M,), if the output is a state times and plus constants."""
    k = _index(system, output.expression)
    if k is not None:
        return k, y
    seen = output.expression.free_symbols & set(system.x)
    if len(seen) != 1 or not output.expression.free_symbols <= {*seen, *system.p, *system.c}:
        return None
    (state,) = seen
    gain = sp.diff(output.expression, state)
    offset = sp.expand(output.expression - gain * state)
    if gain.has(state) or offset.has(state):
        return None
    none = np.zeros((1, len(system.x))), np.zeros((1, len(system.u))), np.empty(0), np.array(system.values)
    values = numpy_system_function(system, [gain, offset], efforts_zero=True)(0.0, *none, constants)
    if not (np.isfinite(values).all() and np.all(values[..., 0] != 0.0)):
        return None
    return system.x.index(state), (y - values[..., 1]) / values[..., 0]


def _index(system: System, expression: sp.Expr) -> int | None:
    """The state that `expression` is."""
    return system.x.index(expression) if expression in system.x else None


def _undelay(x: Array, shown: dict[int, Output], period: float, offsets: Offsets) -> None:
    """Read every shown state later by the delay of its output, in place."""
    for k, output in shown.items():
        if output.delay > 0.0:
            for a, b in pairwise(offsets):
                x[a:b, k] = shifted(x[a:b, k], period, output.delay, "cubic")
