"""Exact densities of the outputs of a monotone response to independent parameters."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import final

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.uncertainty.density import Density
from unmodelled.uncertainty.families import Family
from unmodelled.uncertainty.level_curves import LevelCurves
from unmodelled.uncertainty.observed import check_confined
from unmodelled.uncertainty.surface import ResponseSurface

#: Nodes along the part of a level curve that has probability.
NODES = 64
#: Probability in either tail of a parameter that is left out of the integrals, and out of the window.
TAIL, WINDOW_TAIL = 1e-14, 1e-9
#: Grid over the parameters for the ends of the window; a monotone response takes them at its corners.
CORNERS = 5
#: Values of every output between which cumulative probabilities are interpolated.
KNOTS = 257
#: Values whose level curves are followed at a time.
BLOCK = 16


@final
@dataclass(frozen=True, eq=False)
class PushForward(Density):
    """Densities of Y = M(theta), by integration along the level curves of M.

    f_Y(y) is the integral over theta_1 of f_1(theta_1) f_2(theta_2(y, theta_1)) / |dM/dtheta_2|; for one
    parameter it is f(theta(y)) / |M'| (footnote 4). If M is monotone along both axes, the integral is taken
    over x - y of the unit box instead of theta_1. This resolves level curves of any slope, and so any small
    standard deviation of either parameter. Gauss-Legendre nodes lie between the points where the curve enters
    and leaves the box of practically all probability, so that clipped densities are computed accurately.
    """

    surface: ResponseSurface
    families: tuple[Family, ...]
    alpha: Array  # (n, 2)

    def __post_init__(self) -> None:
        check_confined(self.families, self.alpha, self.surface.names, self.surface.bounds)

    def log_density(self, y: Array) -> Array:
        rows = np.reshape(y, (-1, np.shape(y)[-1]))
        blocks = [curves.density(self.families, self.alpha) for curves in self._curves(rows)]
        with np.errstate(divide="ignore"):
            return np.asarray(np.log(np.concatenate(blocks)).reshape(np.shape(y)))

    def cumulative(self, y: Array) -> Array:
        """Return the probabilities (..., L) up to y (..., L), by cubic interpolation between `KNOTS` values.

        The first call takes as long as `KNOTS` densities.
        """
        low, step, below, density = self._table
        place = np.clip((y - low) / step, 0.0, KNOTS - 1.0)
        knot = np.minimum(np.nan_to_num(place), KNOTS - 2.0).astype(np.int64)
        outputs = np.arange(low.size)
        here, there = below[knot, outputs], below[knot + 1, outputs]
        slope, slope_there = step * density[knot, outputs], step * density[knot + 1, outputs]
        t, rise = place - knot, there - here
        bend = slope + slope_there - 2.0 * rise
        value = here + t * (slope + t * (rise - slope - bend * (1.0 - t)))
        return np.clip(value, here, there)

    def window(self) -> Array:
        low, high = self._box(WINDOW_TAIL).T
        axes = np.linspace(low, high, CORNERS).T
        theta = np.stack([axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")], axis=1)
        y = self.surface(theta)
        return np.stack([y.min(0), y.max(0)], axis=-1)

    @cached_property
    def _table(self) -> tuple[Array, Array, Array, Array]:
        """Lowest knots (L,), their spacings (L,), cumulative probabilities and densities (KNOTS, L)."""
        low, high = self.window().T
        knots = np.linspace(low, high, KNOTS)
        blocks = [
            (curves.cumulative(self.families, self.alpha), curves.density(self.families, self.alpha))
            for curves in self._curves(knots)
        ]
        below, density = (np.concatenate(parts) for parts in zip(*blocks, strict=True))
        rising = np.maximum.accumulate(np.clip(below, 0.0, 1.0), axis=0)
        return low, (high - low) / (KNOTS - 1), rising, density

    def _curves(self, rows: Array) -> Iterator[LevelCurves]:
        for i in range(0, len(rows), BLOCK):
            yield self.surface.monotone.curves(rows[i : i + BLOCK], self._part, NODES)

    @cached_property
    def _part(self) -> Array:
        return self._box(TAIL)

    def _box(self, tail: float) -> Array:
        """Return quantiles (n, 2) that leave out the probability `tail` on either side, within the bounds."""
        levels = np.array([tail, 1.0 - tail])
        ends = [family.quantile(levels, two) for family, two in zip(self.families, self.alpha, strict=True)]
        return np.clip(ends, *self.surface.bounds.T[:, :, None])
