"""Determine the time of a model's event in measured experiments: the shifting times of section 3.3.1."""

from __future__ import annotations

import numpy as np
import pandas as pd
import sympy as sp
from scipy.optimize import least_squares

from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.logs.logs import Logs
from unmodelled.logs.measurements import names
from unmodelled.logs.time_units import on_clock
from unmodelled.systems.experiments import event_named
from unmodelled.systems.model import TIME, Event, System, symbol
from unmodelled.systems.numeric import numpy_system_function

SUSTAINED = 10  # samples over which the expression must stay down
SMALL = 2e-3  # share of its range below which it counts as zero, besides noise
SHARE = 0.1  # of its peak below which its fall is fitted; a longer stretch of it is no parabola
FEWEST = 8  # samples on either side that are fitted
ROUNDING = 1e-9


def event_times(logs: Logs, system: System, event: str) -> pd.DataFrame:
    """Find when the event first happened in each experiment.

    The event's expression is evaluated on the states that the outputs show. A parabola is fitted to its first
    lasting fall through zero, broken off at zero where the model holds it there afterwards (locked shafts).
    """
    if names(system) != (logs.outputs, logs.inputs, logs.states, logs.constants):
        raise BadInput(f"system {system.name}: its names are not those of the logs")
    found = event_named(system, event)
    _check_known(logs, system, found)
    values, held = _values(logs, system, found.expression), _holds(logs, system, found)
    rows = []
    for i, name in enumerate(logs.ids):
        t, z = logs.t[logs.rows(i)], values[logs.rows(i)]
        if not np.isfinite(z).all():
            at = t[~np.isfinite(z)][0]
            when = on_clock(at, logs.clock)
            raise BadInput(f"experiment {name}: the event {event!r} has no finite value at t = {when}")
        around = _fall(z, held)
        if around is None:
            raise BadInput(
                f"experiment {name}: the event {event!r} never happens: its expression does not fall from "
                f"positive through zero within {t[-1]:.4g} s"
            )
        rows.append((name, *_located(t[around], z[around], held)))
    return pd.DataFrame(rows, columns=["id", "time", "deviation"])


def _check_known(logs: Logs, system: System, event: Event) -> None:
    used = event.expression.free_symbols
    place = f"system {system.name}: events.{event.name}"
    for state, measured in zip(system.x, logs.measured, strict=True):
        if state in used and not measured:
            raise BadInput(f"{place}: needs the state {str(state)!r}, which no output shows")
    for name in system.uncertain:
        if symbol(name) in used:
            raise BadInput(f"{place}: needs the parameter {name!r}, which is still to be identified")


def _values(logs: Logs, system: System, *expressions: sp.Expr) -> Array:
    """`expressions` at every sample, (M,) if there is one, else (M, k)."""
    function = numpy_system_function(system, expressions, efforts_zero=True)
    values = function(logs.t, logs.x, logs.u, None, np.array(system.values), logs.c[logs.owner])
    return values[:, 0] if len(expressions) == 1 else values


def _holds(logs: Logs, system: System, event: Event) -> bool:
    """Whether the dynamics after the event keep its expression where it is."""
    if event.then is None or event.expression.free_symbols & {TIME, *system.u}:
        return False
    parts = [sp.diff(event.expression, x) * rate for x, rate in zip(system.x, event.then, strict=True)]
    values = _values(logs, system, *parts).reshape(len(logs.t), -1)
    values = values[np.isfinite(values).all(axis=1)]
    return bool(np.all(np.abs(values.sum(axis=1)) <= ROUNDING * np.abs(values).sum(axis=1).max(initial=0.0)))


def _fall(z: Array, held: bool) -> slice | None:
    """The samples around the first lasting fall of `z` (n,) from positive through zero, if there is one."""
    noise = np.median(np.abs(np.diff(z, 2))) / 0.6745 / np.sqrt(6.0)
    small = max(3.0 * noise / np.sqrt(SUSTAINED), SMALL * np.ptp(z))
    ahead = np.convolve(z, np.full(SUSTAINED, 1.0 / SUSTAINED), "valid")
    high = np.flatnonzero(ahead > small)
    low = np.flatnonzero(ahead <= (small if held else -small))
    low = low[low > high[0]] if high.size else high
    if not low.size:
        return None
    k = int(low[0])
    peak = SHARE * ahead[:k].max()
    before = max(k - int(np.flatnonzero(ahead[:k] >= peak)[-1]), FEWEST)
    return slice(max(k - before, 0), k + before)


def _located(t: Array, z: Array, held: bool) -> tuple[float, float]:
    """Return the zero of a parabola through z (n,) at times t (n,), and its standard error."""
    middle = float(np.median(t))

    def model(p: Array) -> Array:
        ahead = p[0] - (t - middle)
        ahead = np.maximum(ahead, 0.0) if held else ahead
        return np.asarray(ahead * (p[1] + p[2] * ahead) - z)

    start = [0.0, (z[0] - z[-1]) / (t[-1] - t[0]), 0.0]
    fit = least_squares(model, start, x_scale="jac")
    variance = 2.0 * fit.cost / (len(t) - len(start)) * np.linalg.pinv(fit.jac.T @ fit.jac)
    return middle + float(fit.x[0]), float(np.sqrt(variance[0, 0]))
