"""Exact log-densities of given data, for thousands of parameter distributions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.base.compiling import compiled
from unmodelled.base.errors import BadInput
from unmodelled.uncertainty.families import Family
from unmodelled.uncertainty.level_curves import Monotone

#: Nodes along a level curve, and cells of the bounds in which densities of the parameters are tabulated:
#: enough for standard deviations of a 300th of the width of the bounds, to 1e-3 in the logarithm.
NODES, CELLS = 384, 2048
#: Probability of parameters outside the bounds that does not count.
NEGLIGIBLE = 1e-6


@final
@dataclass(frozen=True, eq=False)
class Observed:
    """Level curves of L data, followed once through the whole box of parameters.

    The density of a datum under a parameter distribution is a sum over fixed nodes. The parameters' densities
    are interpolated from tables, which is fast; `PushForward` is more accurate for densities with jumps.
    """

    names: tuple[str, ...]
    bounds: Array  # (n, 2)
    position: Array  # (L, K, n), nodes in cells of the tables
    weight: Array  # (L, K)

    @classmethod
    def of(cls, names: Sequence[str], surface: Monotone, y: Array) -> Observed:
        """Follow the level curves of data (L,)."""
        if y.shape != surface.direction.shape:
            raise BadInput(
                f"data must be one number for each of {surface.direction.size} outputs, got shape {y.shape}"
            )
        curves = surface.curves(y[None], surface.bounds, NODES)
        low, high = surface.bounds.T
        position = CELLS * (curves.theta[0] - low) / (high - low)
        return cls(
            tuple(names), surface.bounds, np.clip(position, 0.0, CELLS), curves.weights[0, ..., 0].copy()
        )

    def log_density(self, families: Sequence[Family], alphas: Array) -> Array:
        """Return the natural logarithms (B, L) of the densities at the data under distributions (B, n, 2)."""
        tables = np.empty((len(alphas), len(families), CELLS + 1))
        low, high = self.bounds.T
        grids = np.linspace(low, high, CELLS + 1)
        for table, alpha in zip(tables, alphas, strict=True):
            check_confined(families, alpha, self.names, self.bounds)
            for i, (family, two) in enumerate(zip(families, alpha, strict=True)):
                table[i] = family.density(grids[:, i], two)
        with np.errstate(divide="ignore"):
            return np.asarray(np.log(_products(self.position, self.weight, tables)))


def check_confined(families: Sequence[Family], alpha: Array, names: Sequence[str], bounds: Array) -> None:
    """Refuse a distribution (n, 2) that a family does not have, or that reaches outside the bounds (n, 2)."""
    for family, two, name, (low, high) in zip(families, alpha, names, bounds, strict=True):
        try:
            family.check(two)
        except BadInput as error:
            raise BadInput(f"{name}: {error}") from None
        start, stop = family.support(two)
        if start >= low and stop <= high:
            continue
        below, above = family.cumulative(np.array([low, high]), two)
        outside = below + 1.0 - above
        if outside > NEGLIGIBLE:
            raise BadInput(
                f"{name} lies outside {low:g} to {high:g}, where the response is known, with probability "
                f"{outside:.2g}: clip its distribution or widen the bounds"
            )


@compiled
def _products(position: Array, weight: Array, tables: Array) -> Array:
    """Return sums (B, L) over K nodes of weights (L, K) times tabulated functions of their coordinates."""
    batch, cells = len(tables), tables.shape[2] - 1
    outputs, nodes, n = position.shape
    total = np.zeros((batch, outputs))
    for b in range(batch):
        for l in range(outputs):
            for k in range(nodes):
                product = weight[l, k]
                for i in range(n):
                    cell = min(int(position[l, k, i]), cells - 1)
                    here, following = tables[b, i, cell], tables[b, i, cell + 1]
                    product *= here + (position[l, k, i] - cell) * (following - here)
                total[b, l] += product
    return total
