"""A response simulated once on a grid and interpolated from then on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import final

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import Akima1DInterpolator, CubicHermiteSpline
from scipy.sparse import csr_array

from unmodelled.base.errors import BadInput
from unmodelled.uncertainty.level_curves import Monotone
from unmodelled.uncertainty.observed import Observed
from unmodelled.uncertainty.response import Response, check_inside, checked

Array = NDArray[np.float64]

#: A slope at a node may be this many times the smaller of the two secants beside it: up to three, a cubic
#: between two nodes does not leave the interval of their values.
STEEPEST = 3.0
#: Points at which the outputs are interpolated at a time.
BLOCK = 20_000


@final
@dataclass(frozen=True, eq=False)
class ResponseSurface:
    """All outputs of a response on a tensor grid of its bounds, and piecewise cubics between the nodes.

    The slopes at the nodes are Akima's: they follow from the four nearest secants, so that a kink of the
    response disturbs only the cells next to it. A polynomial through all nodes, or a spline, carries it
    across the box, as waves that even turn a monotone response around. Evenly spaced nodes serve kinks that
    lie anywhere, and elsewhere for every output. The slopes are limited, so that the surface rises where the
    nodes rise.

    A surface is a response itself.

    Attributes:
        names: of the n parameters. bounds: (n, 2).
        values: (m_1, ..., m_n, L) outputs at evenly spaced nodes from bound to bound.
    """

    names: tuple[str, ...]
    bounds: Array
    values: Array

    @classmethod
    def of(cls, response: Response, nodes: Sequence[int]) -> ResponseSurface:
        """Simulate `response` once at every node.

        Args:
            nodes: (n,) nodes along every axis, at least 3; (15, 9) of a response of two parameters are 135
                simulations. `errors` tells along which axis more of them would pay.

        Raises BadInput for too few nodes, and where an output does not exist.
        """
        if len(nodes) != len(response.names):
            raise BadInput(f"nodes: {len(response.names)} parameters need as many numbers, got {len(nodes)}")
        if min(nodes) < 3:
            raise BadInput(f"nodes: at least 3 along every axis, got {min(nodes)}")
        axes = [np.linspace(a, b, m) for (a, b), m in zip(response.bounds, nodes, strict=True)]
        theta = np.stack([axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")], axis=1)
        values = checked(response, theta)
        return cls(response.names, response.bounds, values.reshape(*nodes, -1))

    def __call__(self, theta: Array) -> Array:
        """(S, L) outputs at (S, n) parameters; raises BadInput outside the bounds."""
        check_inside(self, theta)
        low, high = self.bounds.T
        share = np.clip((theta - low) / (high - low), 0.0, 1.0)
        blocks = [self._block(share[i : i + BLOCK]) for i in range(0, max(len(share), 1), BLOCK)]
        return np.concatenate(blocks)

    def at(self, y: Array) -> Observed:
        """Where in the bounds the outputs equal data y (L,), for their log-likelihood under any alpha.

        Raises BadInput as `monotone` does, and where y has another length.
        """
        return Observed.of(self.names, self.monotone, y)

    @cached_property
    def monotone(self) -> Monotone:
        """The surface in the form in which its level curves are followed.

        Raises BadInput where an output is not monotone along any axis, and for more than two parameters.
        """
        return Monotone.of(self.names, self.bounds, self.values, self._hermite)

    @property
    def spans(self) -> Array:
        """(L, 2) smallest and largest value of every output at the nodes."""
        axes = tuple(range(len(self.names)))
        return np.stack([self.values.min(axes), self.values.max(axes)], axis=-1)

    @property
    def errors(self) -> Array:
        """(n, L) largest error along every axis of a surface that has only every other node of that axis.

        Measured at the nodes left out, in the unit of the outputs. The surface itself is closer by a factor
        of two at kinks and of about ten where the response is smooth.
        """
        return np.stack([self._error(axis) for axis in range(len(self.names))])

    def _error(self, axis: int) -> Array:
        values = np.moveaxis(self.values, axis, 0)
        x = np.arange(float(len(values)))
        kept = np.union1d(np.arange(0, len(x), 2), len(x) - 1)
        coarse = CubicHermiteSpline(x[kept], values[kept], _slopes(values[kept], x[kept]))
        return np.asarray(np.abs(coarse(x) - values).reshape(-1, values.shape[-1]).max(0))

    @cached_property
    def _hermite(self) -> Array:
        """(2 m_1, ..., 2 m_n, L) every value followed by its slope per cell, along every axis."""
        table = self.values
        for axis, nodes in enumerate(self.values.shape[:-1]):
            along = np.moveaxis(table, axis, 0)
            pairs = np.stack([along, _slopes(along, np.arange(float(nodes)))], axis=1)
            table = np.moveaxis(pairs.reshape(2 * nodes, *along.shape[1:]), 0, axis)
        return table

    def _block(self, share: Array) -> Array:
        """(S, L) outputs at points (S, n) of the unit box: a sparse product with `_hermite`."""
        samples = len(share)
        columns, weights = np.zeros((samples, 1), dtype=np.int64), np.ones((samples, 1))
        for k, nodes in enumerate(self.values.shape[:-1]):
            position = share[:, k] * (nodes - 1)
            cell = np.minimum(position.astype(np.int64), nodes - 2)
            here = 2 * cell[:, None] + np.arange(4)
            size = (samples, 4 ** (k + 1))
            columns = (columns[:, :, None] * (2 * nodes) + here[:, None, :]).reshape(size)
            weights = (weights[:, :, None] * _cubics(position - cell)[:, None, :]).reshape(size)
        table = self._hermite.reshape(-1, self.values.shape[-1])
        starts = np.arange(samples + 1) * columns.shape[1]
        rows = csr_array((weights.ravel(), columns.ravel(), starts), shape=(samples, len(table)))
        return np.asarray(rows @ table)


def _cubics(x: Array) -> Array:
    """(S, 4) Hermite's polynomials at (S,) positions in a cell: of value and slope here, then there."""
    y = 1.0 - x
    return np.stack([(1.0 + 2.0 * x) * y * y, x * y * y, (1.0 + 2.0 * y) * x * x, -y * x * x], axis=1)


def _slopes(values: Array, x: Array) -> Array:
    """Akima's slopes of values (m, ...) at x (m,), limited to keep the values' order."""
    free = Akima1DInterpolator(x, values).derivative()(x)
    secants = np.diff(values, axis=0) / np.diff(x).reshape(-1, *[1] * (values.ndim - 1))
    before, after = np.concatenate([secants[:1], secants]), np.concatenate([secants, secants[-1:]])
    limit = STEEPEST * np.minimum(np.abs(before), np.abs(after))
    kept = np.sign(before) * np.clip(np.sign(before) * free, 0.0, limit)
    return np.asarray(np.where(before * after > 0.0, kept, 0.0))
