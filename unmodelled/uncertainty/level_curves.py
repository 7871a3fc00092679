"""Level curves of a response of one or two parameters, and densities as sums along them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from unmodelled.base.arrays import Array, Indices, Mask
from unmodelled.base.errors import BadInput
from unmodelled.uncertainty.families import Family
from unmodelled.uncertainty.families.orthogonal import gauss_legendre
from unmodelled.uncertainty.tracing import follow, steepness

#: Share of an output's range by which it may move against its sense between two nodes: a simulation's noise.
NOISE = 1e-3
#: Slope, in ranges of the output over the box, that counts as none, and points a cell where it is looked for.
FLAT, REFINEMENT = 1e-6, 4


@final
@dataclass(frozen=True, eq=False)
class Monotone:
    """Bicubic surfaces of L outputs over the bounds of one or two parameters, mirrored so that they rise.

    With one parameter nothing changes along the second axis.
    """

    bounds: Array  # (n, 2)
    #: (L, 2 m_1, 2 m_2), values and slopes per cell, alternating, over the unit square.
    tables: Array
    falling: Mask  # (L, n), whether an axis is mirrored
    #: (L,), axis along which a surface rises and lines meet its level curves: 0, 1, or 2 for both.
    direction: Indices

    @classmethod
    def of(cls, names: Sequence[str], bounds: Array, values: Array, hermite: Array) -> Monotone:
        """Find the directions along which outputs are monotone, from values (m_1, ..., m_n, L) at nodes."""
        n = len(names)
        if n > 2:
            raise BadInput(
                f"level curves need one or two parameters, got {n} ({', '.join(names)}): mark "
                "fewer, or leave out push_forward"
            )
        span = np.ptp(values.reshape(-1, values.shape[-1]), axis=0)
        rising = np.stack([_fall(values, axis) <= NOISE * span for axis in range(n)], axis=1)
        falling = np.stack([_fall(-values, axis) <= NOISE * span for axis in range(n)], axis=1) & ~rising
        tables = np.ascontiguousarray(np.moveaxis(hermite, -1, 0))
        for axis in range(n):
            mirrored = falling[:, axis]
            tables[mirrored] = _mirrored(tables[mirrored], axis + 1)
        if n == 1:
            tables = np.stack([tables, np.zeros_like(tables)] * 2, axis=2)
        along = rising | falling
        usable = np.zeros((len(span), 3), dtype=bool)
        usable[:, :n] = along
        usable[:, 2] = along.all(1) & (n == 2)
        usable &= steepness(tables, REFINEMENT) > FLAT * span[:, None]
        if not usable.any(1).all():
            output = int(np.argmin(usable.any(1)))
            raise BadInput(
                f"non-monotone response: output {output + 1} of {len(span)} neither rises nor falls "
                f"throughout along {' or '.join(names)}: narrow the bounds, or leave out push_forward"
            )
        # both axes before one: lines along one axis do not resolve a steep curve as well
        return cls(bounds, tables, falling, 2 - np.argmax(usable[:, ::-1], axis=1))

    def curves(self, y: Array, ends: Array, nodes: int) -> LevelCurves:
        """Follow the level curves of values (P, L) of the outputs within the box `ends` (n, 2)."""
        n, outputs = len(self.bounds), len(self.tables)
        low, width = self.bounds[:, 0], np.ptp(self.bounds, axis=1)
        start, stop = (ends - low[:, None]).T / width
        part = np.tile([0.0, 1.0], (outputs, 2, 1))
        part[:, :n, 0] = np.where(self.falling, 1.0 - stop, start)
        part[:, :n, 1] = stop - start
        points, weights = gauss_legendre(nodes if n == 2 else 1)
        points, weights = 0.5 + 0.5 * points, 0.5 * weights
        share, along = np.empty((2, *y.shape, len(points), 2))
        last = np.empty(y.shape)
        # a copy: for an array that cannot be written to, all of this would be compiled once more
        follow(self.tables, self.direction, part, y.copy(), points, weights, share, along, last)
        share, falling = share[..., :n], self.falling[:, None]
        last = np.where(self.falling[:, -1], 1.0 - last, last)
        return LevelCurves(
            theta=low + width * np.where(falling, 1.0 - share, share),
            weights=along * [np.prod(width), np.prod(width[1:])],
            end=low[-1] + width[-1] * last,
            falling=self.falling,
        )


@final
@dataclass(frozen=True, eq=False)
class LevelCurves:
    """Quadrature nodes along the level curves of P values of L outputs, for independent parameters."""

    theta: Array  # (P, L, K, n), nodes
    weights: Array  # (P, L, K, 2), of products of densities, and of those with F_1 instead of f_1
    end: Array  # (P, L), value of the last parameter at the end of each curve
    falling: Mask  # (L, n), whether an output falls along an axis

    def density(self, families: Sequence[Family], alpha: Array) -> Array:
        """Return the densities (P, L) of the outputs at the values, for a distribution (n, 2)."""
        product = self.weights[..., 0].copy()
        for i, (family, two) in enumerate(zip(families, alpha, strict=True)):
            product *= family.density(self.theta[..., i], two)
        return np.asarray(product.sum(-1))

    def cumulative(self, families: Sequence[Family], alpha: Array) -> Array:
        """Return the probabilities (P, L) of outputs up to the values, for a distribution (n, 2)."""
        below = families[0].cumulative(self.theta[..., 0], alpha[0])
        product = self.weights[..., 1] * np.where(self.falling[:, None, 0], 1.0 - below, below)
        if len(families) == 1:
            return np.asarray(product.sum(-1))
        below = families[1].cumulative(self.end, alpha[1])
        product *= families[1].density(self.theta[..., 1], alpha[1])
        return np.asarray(product.sum(-1) + np.where(self.falling[:, 1], 1.0 - below, below))


def _fall(values: Array, axis: int) -> Array:
    """Return the largest fall between two nodes along an axis, shape (L,)."""
    falls = -np.diff(values, axis=axis)
    return np.asarray(falls.reshape(-1, values.shape[-1]).max(0))


def _mirrored(tables: Array, axis: int) -> Array:
    """Return tables with one axis reversed, so that slopes change sign."""
    size = tables.shape[axis]
    order = np.arange(size).reshape(-1, 2)[::-1].ravel()
    signs = np.expand_dims(np.tile([1.0, -1.0], size // 2), tuple(range(1, tables.ndim - axis)))
    return np.asarray(np.take(tables, order, axis) * signs)
