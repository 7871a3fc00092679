"""Bounds of the parameters of a search, and their mapping to the unit cube."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from unmodelled.base.arrays import Array, Mask
from unmodelled.base.errors import BadInput

#: Ratio of positive bounds from which a parameter is searched on a logarithmic scale.
DECADE = 10.0


@dataclass(frozen=True)
class Box:
    """Bounds of k parameters; a parameter whose bounds are equal is fixed, the others are free.

    The free parameters span a unit cube. The scale is logarithmic if both bounds are positive and a factor of
    10 apart, as for a standard deviation of unknown magnitude, otherwise linear.
    """

    bounds: Array  # (k, 2), finite

    def __post_init__(self) -> None:
        for k, (low, high) in enumerate(self.bounds):
            if not (np.isfinite([low, high]).all() and low <= high):
                raise BadInput(
                    f"bounds of parameter {k + 1}: must be finite with lower <= upper, got {low:g}, {high:g}"
                )

    @property
    def size(self) -> int:
        """Number of parameters k, including fixed ones."""
        return len(self.bounds)

    @cached_property
    def free(self) -> Mask:
        """Whether each parameter is free, shape (k,)."""
        return np.asarray(self.bounds[:, 0] < self.bounds[:, 1])

    @cached_property
    def logarithmic(self) -> Mask:
        """Whether each parameter has a logarithmic scale, shape (k,)."""
        low, high = self.bounds.T
        return np.asarray((low > 0.0) & (high >= DECADE * low))

    def to_alpha(self, unit: ArrayLike) -> Array:
        """Return the parameters (..., k) at points (..., free) of the unit cube."""
        share = np.asarray(unit, float)
        low, high = self._scaled(self.bounds.T)[..., self.free]
        alpha = np.broadcast_to(self.bounds[:, 0], (*share.shape[:-1], self.size)).copy()
        alpha[..., self.free] = low + share * (high - low)
        alpha[..., self._curved] = np.exp(alpha[..., self._curved])
        return self.clip(alpha)

    def to_unit(self, alpha: ArrayLike) -> Array:
        """Return the points (..., free) of the unit cube that stand for parameters (..., k)."""
        low, high = self._scaled(self.bounds.T)[..., self.free]
        inside = self._scaled(self.clip(alpha))[..., self.free]
        return np.asarray((inside - low) / (high - low))

    def clip(self, alpha: ArrayLike) -> Array:
        """Return parameters (..., k), moved to the nearest point within the bounds."""
        return np.asarray(np.clip(alpha, self.bounds[:, 0], self.bounds[:, 1]))

    def pinned(self, values: dict[int, float]) -> Box:
        """Return the box with some parameters fixed."""
        bounds = self.bounds.copy()
        for index, value in values.items():
            bounds[index] = value
        return Box(bounds)

    @cached_property
    def _curved(self) -> Mask:
        return self.free & self.logarithmic

    def _scaled(self, alpha: Array) -> Array:
        out = np.array(alpha, float)
        out[..., self._curved] = np.log(out[..., self._curved])
        return out
