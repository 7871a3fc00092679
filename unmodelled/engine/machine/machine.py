"""A register machine that runs any system at once, without compiling anything for it.

A system becomes a short program: instructions on registers of `LANES` numbers, free runs side by side with
other starts or other parameters. The interpreter (`machine_loops`) is compiled once; a new structure costs
milliseconds. Where one structure runs for minutes, a generated kernel (`compiled`) is as fast or faster.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from unmodelled.engine.machine import machine_loops
from unmodelled.engine.machine.machine_program import Program

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


class Windows(NamedTuple):
    """Where free runs start and what drives them.

    Attributes:
        u: (rows, inputs) at the samples; further tables of the same samples may follow. t: (samples,) s.
        start: (windows,) first samples. steps: (windows,) how many samples follow.
        owner: (windows,) which of the experiments, whose parameters and constants count.
        shift: (sets,) rows of `u` before the table that a set of parameters reads.
    """

    u: Array
    t: Array
    start: Indices
    steps: Indices
    owner: Indices
    shift: Indices

    def checked(self) -> Windows:
        """The same, as the interpreter reads it.

        Raises:
            ValueError: when a window leaves the samples.
        """
        end = self.start + self.steps
        rows = len(self.u) - self.shift.max(initial=0)
        inside = not len(end) or (self.start.min() >= 0 and self.steps.min() >= 0 and end.max() < len(self.t))
        if not (inside and len(self.t) <= rows and self.shift.min(initial=0) >= 0):
            raise ValueError(f"windows must lie within {len(self.t)} samples of {rows} rows")
        whole = (np.ascontiguousarray(a, np.int64) for a in (self.start, self.steps, self.owner, self.shift))
        return Windows(_numbers(self.u), _numbers(self.t), *whole)


def simulated(
    program: Program,
    windows: Windows,
    p: Array,
    c: Array,
    x0: Array,
    substeps: int,
    period: float,
    hold: float = 1.0,
) -> Array:
    """Free runs by Runge and Kutta's method of order four, all windows for all sets of parameters.

    Args:
        program: whose observed values are wanted. windows: as many as x0 has.
        p: (experiments, sets, parameters). c: (experiments, constants).
        x0: (windows, sets, states).
        substeps: steps per sample. period: between samples, s.
        hold: 0 holds an input until the next sample, 1 goes straight to the next sample's value.

    Returns:
        (windows, sets, most steps + 1, observed); nan after the end of a window, nan or inf where it
        diverged.

    Raises:
        ValueError: when a window leaves the samples, or sizes differ.
    """
    windows = windows.checked()
    experiments = int(windows.owner.max(initial=-1)) + 1
    at = program.at
    expected = {
        "x0": (len(windows.start), len(windows.shift), len(program.rates)),
        "p": (max(experiments, len(p)), len(windows.shift), at.c - at.p),
        "c": (max(experiments, len(c)), at.numbers - at.c),
        "u": (len(windows.u), at.t - at.u),
    }
    for name, array in {"x0": x0, "p": p, "c": c, "u": windows.u}.items():
        if array.shape != expected[name]:
            raise ValueError(f"{name} must have the shape {expected[name]}, got {array.shape}")
    shape = (*x0.shape[:2], int(windows.steps.max(initial=0)) + 1, len(program.shown))
    y = np.full(shape, np.nan)
    numbers = (_numbers(a) for a in (p, c, x0))
    machine_loops.simulate(program, windows, *numbers, substeps, period, hold, y)
    return y


def evaluated(program: Program, t: Array, x: Array, u: Array, p: Array, c: Array) -> Array:
    """The observed values (..., observed); leading axes of t (...) and of the others (..., k) broadcast."""
    parts = [np.asarray(t, np.float64)[..., None], *(np.asarray(a, np.float64) for a in (x, u, p, c))]
    shape = np.broadcast_shapes(*(a.shape[:-1] for a in parts))
    rows = int(np.prod(shape))
    flat = (np.broadcast_to(a, (*shape, a.shape[-1])).reshape(rows, a.shape[-1]) for a in parts)
    y = np.empty((rows, len(program.shown)))
    machine_loops.evaluate(program, *map(_numbers, flat), y)
    return y.reshape(*shape, len(program.shown))


def _numbers(values: Array) -> Array:
    return np.require(values, np.float64, ["C", "W"])
