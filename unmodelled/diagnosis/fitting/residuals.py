"""Multi-step errors of windows, their derivatives by what is fitted, and how much each of them counts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from unmodelled.diagnosis.data.gap import LARGEST_ERROR
from unmodelled.diagnosis.fitting import error_kernels
from unmodelled.diagnosis.fitting.simulation import Simulation
from unmodelled.diagnosis.fitting.unknowns import Unknowns

Array = NDArray[np.float64]

#: Forward differences, in units of an unknown and of the noise of a state at the start.
STEP, START_STEP = 1e-4, 0.1
#: Standard deviations beyond which an error counts linearly and no longer squared (Huber).
TUNING = 2.0


class Errors:
    """Residuals of one simulation.

    Args:
        unknowns: what may change. sigma: (windows, measured states) noise of the states at the start.
        substeps: of the integration.
    """

    def __init__(self, unknowns: Unknowns, sigma: Array, substeps: int) -> None:
        self.unknowns, self.sigma, self.substeps = unknowns, sigma, substeps
        self.simulations = 0

    @property
    def simulation(self) -> Simulation:
        return self.unknowns.simulation

    @property
    def largest(self) -> Array:
        """(outputs,) what errors are cut at."""
        recording = self.simulation.recording
        return LARGEST_ERROR * recording.scale / recording.noise

    def __call__(self, z: Array, moved: Array) -> Array:
        """Errors (windows, sets, most steps, outputs) in standard deviations of the sensors' noise.

        An error beyond `largest`, or of a simulation that diverged, is cut there; after the end of a window
        there is none.

        Args:
            z: (sets, entries).
            moved: (windows, sets, measured states) how far the starts are moved, in `sigma`.
        """
        recording = self.simulation.recording
        runs = self.simulation(self.unknowns.numbers(z), moved * self.sigma[:, None], self.substeps)
        self.simulations += len(z)
        r = error_kernels.cut_errors(runs.y, runs.measured, recording.noise, self.largest, recording.steps)
        return np.asarray(r)

    def around(self, z: Array, moved: Array) -> tuple[Array, Array]:
        """A point z (entries,), moved (windows, measured states), and what is next to it in every direction
        that a window sees: one set for each unknown and for each state at the start.
        """
        unknowns, states = self.unknowns, moved.shape[1]
        count = len(unknowns.each)
        points = np.tile(z, (1 + count + states, 1))
        points[1 : 1 + count] += self._steps(z) * (np.arange(count)[:, None] == unknowns.unknown)
        starts = np.repeat(moved[:, None], len(points), axis=1)
        starts[:, 1 + count :] += START_STEP * np.eye(states)
        return points, starts

    def slopes(self, z: Array, r: Array) -> Array:
        """Derivatives (windows, unknowns + measured states, most steps, outputs) at z from the errors
        `around` it. An error that is cut does not change.
        """
        entry = self.unknowns.entry
        steps = np.full((len(r), r.shape[1] - 1), START_STEP)
        steps[:, : entry.shape[1]] = self._steps(z)[entry]
        return np.asarray(error_kernels.forward_differences(r, self.largest, steps))

    def _steps(self, z: Array) -> Array:
        return np.where(z + STEP <= self.unknowns.bounds[1], STEP, -STEP)


def spread(r: Array, counted: NDArray[np.bool_]) -> Array:
    """(outputs,) robust standard deviation of residuals (windows, most steps, outputs), at least noise."""
    return np.maximum(1.4826 * np.median(np.abs(r[counted]), axis=0), 1.0)


def weights(r: Array, scale: Array) -> Array:
    """Of squared residuals (..., outputs) by Huber's loss, relative to `scale` (outputs,)."""
    size = np.abs(r) / scale
    return np.where(size <= TUNING, 1.0, TUNING / np.maximum(size, TUNING)) / scale**2


def loss(r: Array, scale: Array) -> Array:
    """Huber's loss (sets,) of residuals (windows, sets, most steps, outputs)."""
    size = np.abs(r) / scale
    each = np.where(size <= TUNING, 0.5 * size**2, TUNING * (size - 0.5 * TUNING))
    return np.asarray(each.sum((0, 2, 3)))
