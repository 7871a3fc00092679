"""Velocities that were estimated from sampled positions, and how far they may be off."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from unmodelled.logs.differentiate import smooth_derivative

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

#: Draws of noise from which the error is estimated.
REPLICATES = 3


@dataclass(frozen=True)
class Slope:
    """The smoothed derivative of one output.

    Attributes:
        y: (samples,) the smoothed output. v: (samples,) its derivative, per second. width: in samples.
    """

    y: Array
    v: Array
    width: int

    @classmethod
    def of(cls, y: Array, offsets: Indices, period: float) -> Slope:
        """Of the samples (samples,) of experiments one after the other, see `smooth_derivative`."""
        return cls(*smooth_derivative(y, offsets, period))

    def error(self, noise: float, offsets: Indices, period: float) -> Array:
        """(samples,) standard deviation of the error of `v`, by the parametric bootstrap.

        The smoothed output is taken for the truth, given new noise and smoothed again: what comes out is
        wrong by the noise that passes the filter and by what the filter bends. Samples at the same distance
        from an end of their experiment, where half of the filter is missing, share an estimate, as do all
        others.
        """
        truth = np.concatenate([_derivative(self.y[a:b], period) for a, b in pairwise(offsets)])
        square = np.zeros_like(truth)
        for k in range(REPLICATES):
            noisy = self.y + noise * np.random.default_rng(k).standard_normal(len(truth))
            square += (smooth_derivative(noisy, offsets, period)[1] - truth) ** 2 / REPLICATES
        return np.sqrt(self._shared(square, offsets))

    def _shared(self, square: Array, offsets: Indices) -> Array:
        """The mean over samples that have as much of the filter."""
        within = np.concatenate([np.arange(b - a) for a, b in pairwise(offsets)])
        left = np.concatenate([np.arange(b - a)[::-1] for a, b in pairwise(offsets)])
        near = np.minimum(np.minimum(within, left), self.width)
        kind = np.where(left < within, self.width + 1 + near, near)
        kind[near == self.width] = self.width
        count = np.bincount(kind)
        return np.asarray((np.bincount(kind, square) / np.maximum(count, 1))[kind])


def _derivative(y: Array, period: float) -> Array:
    return np.asarray(CubicSpline(period * np.arange(len(y)), y)(period * np.arange(len(y)), 1))
