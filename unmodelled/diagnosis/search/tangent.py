"""Derivatives of the free runs of a fitted model by numbers of a larger model."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.fitting import error_kernels
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.fitting.residuals import Errors, spread, weights
from unmodelled.diagnosis.fitting.unknowns import Unknowns
from unmodelled.diagnosis.search.least_squares import Columns, Products

Array = NDArray[np.float64]


class Tangent:
    """Errors of a fitted model over some windows, and their derivatives.

    Args:
        base: fitted hypothesis.
        recording: some of the windows that it was fitted to.

    Attributes:
        shared: number of the hypothesis' own unknowns, regressors of every screened candidate.
    """

    def __init__(self, base: FittedHypothesis, recording: Recording) -> None:
        self.base, self.recording = base, recording
        self.unknowns = Unknowns(base.hypothesis.simulation(recording), base.hypothesis.unknowns)
        self.shared = len(self.unknowns.each)
        self.moved, sigma = base.moved(recording)
        self.z = base.vector(self.unknowns)
        self.errors = Errors(self.unknowns, sigma, base.fit.substeps)
        around = self.errors(*self.errors.around(self.z, self.moved))
        self.r = around[:, 0]
        self.later = self.unknowns.simulation.later(self.unknowns.numbers(np.tile(self.z, (2, 1)))[0])[0]
        self.own_slopes = self.errors.slopes(self.z, around)
        self.root = np.sqrt(weights(self.r, spread(self.r, recording.counted)))

    def slopes(self, hypothesis: Hypothesis, sets: Sequence[dict[str, float]]) -> Array:
        """Return the changes of the errors by numbers of a larger model.

        Args:
            hypothesis: larger hypothesis.
            sets: values of its further numbers, by name, SI.

        Returns:
            Changes, shape (windows, sets, most steps, outputs), in standard deviations of the sensor noise.
        """
        simulation = hypothesis.simulation(self.recording)
        known = self.unknowns.simulation.names
        fitted = self.unknowns.numbers(self.z[None])
        own = dict(zip((p.name for p in hypothesis.system.parameters), hypothesis.system.values, strict=True))
        values = np.zeros((len(fitted), len(sets), len(simulation.names)))
        for k, name in enumerate(simulation.names):
            if name in known:
                values[:, :, k] = fitted[:, :, known.index(name)]
            else:
                values[:, :, k] = [given.get(name, own.get(name, 0.0)) for given in sets]
        moved = np.repeat((self.moved * self.errors.sigma)[:, None], len(sets), axis=1)
        runs = simulation(values, moved, self.base.fit.substeps)
        recording, largest = self.recording, self.errors.largest
        r = error_kernels.cut_errors(runs.y, runs.measured, recording.noise, largest, recording.steps)
        later = simulation.later(values[0]) - self.later
        both = np.concatenate([self.r[:, None], self._aligned(r, later)], axis=1)
        return np.asarray(error_kernels.forward_differences(both, largest, np.ones((len(r), len(sets)))))

    def _aligned(self, r: Array, later: NDArray[np.int64]) -> Array:
        """Errors (windows, sets, most steps, outputs) at the samples that the fitted model is compared at.

        They are `later` (sets, outputs) samples earlier; the noise of other samples explains some errors.
        """
        found, sample, counted = np.array(r), np.arange(r.shape[2]), self.recording.counted
        for k, j in zip(*np.nonzero(later), strict=True):
            at = sample - later[k, j]
            inside = (at >= 0) & (at < self.recording.steps[:, None]) & counted
            found[:, k, :, j] = np.where(inside, r[:, k, at % len(at), j], self.r[:, :, j])
        return found

    def products(self, slopes: Array, bounds: Array) -> Iterator[Products]:
        """Yield the products of the hypothesis' own unknowns and of every set of further columns.

        Args:
            slopes: derivatives by the further columns, shape (windows, sets, n, most steps, outputs).
            bounds: bounds of their coefficients, shape (2, sets, n).
        """
        weighted = slopes * self.root[:, None, None]
        return self.columns.beside(weighted.reshape(*slopes.shape[:3], -1), bounds)

    @cached_property
    def columns(self) -> Columns:
        """Return the weighted derivatives by the hypothesis' own unknowns."""
        unknowns, first = self.unknowns, self.shared
        weighted = (self.own_slopes * self.root[:, None]).reshape(*self.own_slopes.shape[:2], -1)
        limits = np.stack(unknowns.bounds) - self.z
        return Columns.of(
            weighted[:, :first],
            (self.r * self.root).reshape(len(self.r), -1),
            weighted[:, first:],
            self.moved,
            self.recording.owner,
            # not by an index: the kernel of the least squares would be compiled for that memory layout, too
            np.take(limits, [int(np.argmax(unknowns.unknown == k)) for k in range(first)], axis=1),
        )
