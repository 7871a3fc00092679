"""States that no output shows, integrated along the experiments with the others imposed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from unmodelled.base.errors import BadInput
from unmodelled.engine.machine.machine import Windows, simulated
from unmodelled.engine.machine.machine_program import Equations, Program, assembled
from unmodelled.systems.model import System

Array = NDArray[np.float64]

SUBSTEPS = (4, 32)  # per sampling period; the second where the first is unstable


def observer(system: System, unknown: Sequence[int]) -> Program:
    """States `unknown` (indices) as outputs, driven by the inputs, then the other states in their order."""
    shown = [system.x[k] for k in unknown]
    imposed = [x for x in system.x if x not in shown]
    rates = [system.dynamics[k] for k in unknown]
    equations = Equations.of(system, shown)
    return assembled(replace(equations, states=shown, inputs=(*system.u, *imposed), rates=rates))


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
    lengths, n = np.diff(offsets), len(ids)
    sample = np.arange(offsets[-1]) - np.repeat(offsets[:-1], lengths)
    driven = np.concatenate([u, np.delete(x, unknown, axis=1)], axis=1)
    windows = Windows(driven, sample * period, offsets[:-1], lengths - 1, np.arange(n), np.zeros(1, np.int64))
    initial = [system.states[k].initial for k in unknown]
    x0 = np.broadcast_to(initial, (n, 1, len(unknown)))
    p = np.broadcast_to(system.values, (n, 1, len(system.values)))
    counted = np.arange(int(lengths.max())) < lengths[:, None]
    program = observer(system, unknown)
    for substeps in SUBSTEPS:
        path = simulated(program, windows, p, c, x0, substeps, period)[:, 0]
        if np.isfinite(path[counted]).all():
            return np.asarray(path[counted])
    bad = ~np.isfinite(path) & counted[:, :, None]
    last, i, k = (int(j) for j in np.argwhere(bad.swapaxes(0, 1))[0])
    raise BadInput(
        f"system {system.name}: dynamics.{system.states[unknown[k]].name} diverges in experiment {ids[i]} at "
        f"t = {last * period:.4g} s when it is integrated from its initial value {initial[k]:g}"
    )
