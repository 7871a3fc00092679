"""Free-run errors of windows, their derivatives by the unknowns, and their weights in the loss."""

from __future__ import annotations

import numpy as np

from unmodelled.base.arrays import Array, Mask
from unmodelled.diagnosis.data.gap import LARGEST_ERROR
from unmodelled.diagnosis.fitting import error_kernels
from unmodelled.diagnosis.fitting.simulation import Simulation
from unmodelled.diagnosis.fitting.unknowns import Unknowns

#: Steps of forward differences, in units of an unknown and of the noise of an initial state.
STEP, START_STEP = 1e-4, 0.1
#: Standard deviations beyond which an error counts linearly and no longer squared (Huber): 95 % of normal
#: errors count squared.
TUNING = 2.0


class Errors:
    """Compute the errors of one simulation; `sigma` (windows, free states): how far starts may be off, SI."""

    def __init__(self, unknowns: Unknowns, sigma: Array, substeps: int) -> None:
        self.unknowns, self.sigma, self.substeps = unknowns, sigma, substeps
        self.simulations = 0

    @property
    def simulation(self) -> Simulation:
        """Return the simulation of the unknowns."""
        return self.unknowns.simulation

    @property
    def largest(self) -> Array:
        """Return the size, shape (outputs,), at which errors are cut, in units of the noise."""
        recording = self.simulation.recording
        return LARGEST_ERROR * recording.scale / recording.noise

    def __call__(self, z: Array, moved: Array) -> Array:
        """Return errors (windows, sets, most steps, outputs) of vectors (sets, entries), in the sensor noise.

        An error beyond `largest`, or of a simulation that diverged, is cut there; after the end of a window
        errors are zero. Starts are `moved` (windows, sets, free states), in standard deviations.
        """
        return self.of_numbers(self.unknowns.numbers(z), moved)

    def of_numbers(self, numbers: Array, moved: Array) -> Array:
        """Return the errors of parameter sets (experiments, sets, numbers), SI, like those of vectors."""
        recording = self.simulation.recording
        runs = self.simulation(numbers, moved * self.sigma[:, None], self.substeps)
        self.simulations += numbers.shape[1]
        r = error_kernels.cut_errors(runs.y, runs.measured, recording.noise, self.largest, recording.steps)
        return np.asarray(r)

    def around(self, z: Array, moved: Array) -> tuple[Array, Array]:
        """Return points (points, entries) and starts: a point, and one for each unknown and start."""
        unknowns, states = self.unknowns, moved.shape[1]
        count = len(unknowns.each)
        points = np.tile(z, (1 + count + states, 1))
        points[1 : 1 + count] += self._steps(z) * (np.arange(count)[:, None] == unknowns.unknown)
        starts = np.repeat(moved[:, None], len(points), axis=1)
        starts[:, 1 + count :] += START_STEP * np.eye(states)
        return points, starts

    def slopes(self, z: Array, r: Array) -> Array:
        """Return derivatives (windows, unknowns + free states, most steps, outputs) of the errors."""
        entry = self.unknowns.entry
        steps = np.full((len(r), r.shape[1] - 1), START_STEP)
        steps[:, : entry.shape[1]] = self._steps(z)[entry]
        return np.asarray(error_kernels.forward_differences(r, self.largest, steps))

    def _steps(self, z: Array) -> Array:
        return np.where(z + STEP <= self.unknowns.bounds[1], STEP, -STEP)


def spread(r: Array, counted: Mask) -> Array:
    """Estimate the robust standard deviation (outputs,) of residuals, at least that of the noise."""
    return np.maximum(1.4826 * np.median(np.abs(r[counted]), axis=0), 1.0)


def weights(r: Array, scale: Array) -> Array:
    """Return the weights (..., outputs) of squared residuals by Huber's loss."""
    size = np.abs(r) / scale
    return np.where(size <= TUNING, 1.0, TUNING / np.maximum(size, TUNING)) / scale**2


def loss(r: Array, scale: Array) -> Array:
    """Return Huber's loss (sets,) of residuals (windows, sets, most steps, outputs)."""
    size = np.abs(r) / scale
    each = np.where(size <= TUNING, 0.5 * size**2, TUNING * (size - 0.5 * TUNING))
    return np.asarray(each.sum((0, 2, 3)))
