"""States that no output shows, integrated along the experiments with the others imposed."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import BadInput
from pipeline.physics.system.model import System
from pipeline.physics.system.numeric import numpy_system_function
from pipeline.progress import track

Array = NDArray[np.float64]

SUBSTEPS = (4, 32)  # per sampling period; the second where the first is unstable


def integrated(
    system: System,
    unknown: Sequence[int],
    ids: Sequence[str],
    period: float,
    offsets: NDArray[np.int64],
    x: Array,
    u: Array,
    c: Array,
) -> Array:
    """States `unknown` (indices) from their initial values, by Runge and Kutta's method of order four.

    Inputs and imposed states run along straight lines between samples; efforts are zero beyond their laws.
    All experiments advance together.

    Args:
        system: the known physics.
        unknown: which states. ids: of the n experiments.
        period: sampling period, s. offsets: (n + 1,) see `Logs`.
        x: (M, states) the others. u: (M, inputs). c: (n, constants).

    Returns:
        (M, len(unknown)).

    Raises:
        BadInput: when a state diverges, naming it, the experiment and the time.
    """
    lengths = np.diff(offsets)
    # experiments that are over stay at their last sample
    rows = np.minimum(np.arange(int(lengths.max()))[:, None], lengths - 1) + offsets[:-1]
    driven = np.concatenate([x, u], axis=1)[rows]  # (N, n, states + inputs)
    running = np.arange(len(rows))[:, None] < lengths
    start = np.tile([system.states[k].initial for k in unknown], (len(lengths), 1))
    rates = _rates(system, unknown, c)
    for substeps in SUBSTEPS:
        path, last = _march(rates, driven, start, period, substeps, running)
        if last == len(rows):
            return np.concatenate([path[:n, i] for i, n in enumerate(lengths)])
    bad = ~np.isfinite(path[last]) & running[last][:, None]
    i, k = (int(j) for j in np.argwhere(bad)[0])
    raise BadInput(
        f"system {system.name}: dynamics.{system.states[unknown[k]].name} diverges in experiment {ids[i]} at "
        f"t = {last * period:.4g} s when it is integrated from its initial value {start[i, k]:g}"
    )


Rates = Callable[[float, Array, Array], Array]  # (t, driven (n, states + inputs), unknown (n, k)) -> (n, k)


def _rates(system: System, unknown: Sequence[int], c: Array) -> Rates:
    f = numpy_system_function(system, [system.closed[k] for k in unknown], efforts_zero=True)
    p, none, states = np.array(system.values), np.empty(0), len(system.states)

    def rates(t: float, driven: Array, z: Array) -> Array:
        x = driven[:, :states].copy()
        x[:, unknown] = z
        return f(t, x, driven[:, states:], none, p, c)

    return rates


def _march(
    rates: Rates, driven: Array, z: Array, period: float, substeps: int, running: NDArray[np.bool_]
) -> tuple[Array, int]:
    """States (N, n, k) at the samples, and the first sample where one is not finite (N if none)."""
    path = np.empty((*driven.shape[:2], z.shape[1]))
    path[0] = z
    h = period / substeps
    with np.errstate(all="ignore"):
        for i in track(range(1, len(driven)), len(driven) - 1, "integrating states that nothing measures"):
            here, step = driven[i - 1], (driven[i] - driven[i - 1]) / substeps
            for s in range(substeps):
                t = (i - 1) * period + s * h
                a, m, b = here + s * step, here + (s + 0.5) * step, here + (s + 1) * step
                k1 = rates(t, a, z)
                k2 = rates(t + 0.5 * h, m, z + 0.5 * h * k1)
                k3 = rates(t + 0.5 * h, m, z + 0.5 * h * k2)
                z = z + h / 6.0 * (k1 + 2.0 * (k2 + k3) + rates(t + h, b, z + h * k3))
            path[i] = z
            if not np.isfinite(z[running[i]]).all():
                return path, i
    return path, len(driven)
