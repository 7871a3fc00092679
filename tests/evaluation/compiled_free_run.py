"""Free runs on the compiled engine, to compare those of the expression machine with."""

from collections.abc import Sequence

import numpy as np
from scipy.interpolate import CubicSpline

from tests.physics.kernel.problems import Array, bare
from unmodelled.base.arrays import Indices
from unmodelled.diagnosis.data.gap import WHOLE, FreeRun, steps_of
from unmodelled.engine.free_run import Integration
from unmodelled.learning.held_out import measured_samples
from unmodelled.learning.rollout import simulate
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System
from unmodelled.systems.numeric import numpy_system_function


def free_run(
    system: System, logs: Logs, horizon: float, how: Integration, runs: Sequence[int] | None = None
) -> FreeRun:
    """Simulate experiments (all unless given) under their logged inputs, anew every `horizon` seconds.

    A window starts at the measured or estimated state and predicts the samples up to the start of the next
    one, that one included. An output with a delay shows what was simulated so long ago; before, at the start
    of an experiment, it shows nothing. The log does not show the states of the last part of an experiment, as
    long as the longest delay; the simulation ends there.
    """
    steps, data, model = steps_of(horizon, logs), measured_samples(logs), bare(system)
    found = FreeRun(
        np.full(logs.y.shape, np.nan), np.zeros(logs.y.shape, np.bool_), np.zeros(len(logs.t), np.int64)
    )
    delays = [output.delay / logs.period for output in system.outputs]
    held, p = int(max(delays) + WHOLE), np.array(system.values)
    functions = [numpy_system_function(system, [output.expression], True) for output in system.outputs]
    for i in range(len(logs)) if runs is None else runs:
        first, end = logs.offsets[i], logs.offsets[i + 1]
        found.window[first:end] = np.maximum(np.arange(end - first) - 1, 0) // steps
        for start in range(first, end - 1 - held, steps):
            rows = np.arange(start, min(start + steps, end - 1 - held) + 1)
            x = simulate(model, 0, data, data.x[rows[:1]], rows[:1], len(rows) - 1, how)[0][0]
            for j, (function, delay) in enumerate(zip(functions, delays, strict=True)):
                whole = int(delay + WHOLE)
                then = _past(logs, rows, x, delay - whole if delay - whole > WHOLE else 0.0)
                shown = function(*then, np.empty(0), p, logs.c[i])[:, 0]
                shown[~np.isfinite(x).all(-1)] = np.nan
                later = rows[1:] + whole
                found.y[later, j], found.counted[later, j] = shown[1:], True
                if delay == 0.0 and start == first:
                    found.y[first, j] = shown[0]
    return found


def _past(logs: Logs, rows: Indices, x: Array, rest: float) -> tuple[Array, Array, Array]:
    """Time, states and inputs `rest` of a period before the samples `rows`, at the first one with it."""
    t, u = logs.t[rows], logs.u[rows]
    if rest == 0.0:
        return t, x, u
    k = np.arange(len(rows), dtype=np.float64)
    # a spline is global: what diverged later must not reach back
    bounded = np.where(np.isfinite(x).all(-1, keepdims=True) & (np.abs(x) < 1e100), x, 0.0)
    before = CubicSpline(k, bounded)(k - rest)
    return t - rest * logs.period, before, (1.0 - rest) * u + rest * logs.u[rows - 1]
