"""Response surface: a response simulated once on a grid, then interpolated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import final

import numpy as np
from scipy.interpolate import Akima1DInterpolator, CubicHermiteSpline
from scipy.sparse import csr_array

from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.uncertainty.level_curves import Monotone
from unmodelled.uncertainty.observed import Observed
from unmodelled.uncertainty.response import Response, check_inside, evaluate_response

#: A slope at a node may be this many times the smaller of the two secants beside it: up to three, a cubic
#: between two nodes does not leave the interval of their values.
STEEPEST = 3.0
#: Points at which the outputs are interpolated at a time.
BLOCK = 20_000


@final
@dataclass(frozen=True, eq=False)
class ResponseSurface:
    """Outputs of a response on a tensor grid of its bounds, piecewise cubic between; itself a response.

    The slopes at the nodes are those of Akima: they depend on the four nearest secants, so that a kink of the
    response disturbs only the neighbouring cells. A spline or a polynomial through all nodes would spread it
    over the box as waves, and even reverse a monotone response. Nodes are evenly spaced, because kinks lie
    elsewhere for every output. The slopes are limited, so that the surface rises wherever the nodes rise.
    """

    names: tuple[str, ...]
    bounds: Array  # (n, 2)
    values: Array  # (m_1, ..., m_n, L), outputs at evenly spaced nodes between the bounds

    @classmethod
    def of(cls, response: Response, nodes: Sequence[int]) -> ResponseSurface:
        """Simulate a response once at every node of a grid."""
        if len(nodes) != len(response.names):
            raise BadInput(
                f"nodes must be {len(response.names)} numbers, one for each parameter, got {len(nodes)}"
            )
        if min(nodes) < 3:
            raise BadInput(f"nodes must be at least 3 along every axis, got {min(nodes)}")
        axes = [np.linspace(a, b, m) for (a, b), m in zip(response.bounds, nodes, strict=True)]
        theta = np.stack([axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")], axis=1)
        values = evaluate_response(response, theta)
        return cls(response.names, response.bounds, values.reshape(*nodes, -1))

    def __call__(self, theta: Array) -> Array:
        """Return outputs (S, L) at parameters (S, n); raise BadInput outside the bounds."""
        check_inside(self, theta)
        low, high = self.bounds.T
        share = np.clip((theta - low) / (high - low), 0.0, 1.0)
        blocks = [self._block(share[i : i + BLOCK]) for i in range(0, max(len(share), 1), BLOCK)]
        return np.concatenate(blocks)

    def at(self, y: Array) -> Observed:
        """Follow the level curves of data (L,), for their log-likelihood under any alpha."""
        return Observed.of(self.names, self.monotone, y)

    @cached_property
    def monotone(self) -> Monotone:
        """Surface in the form in which its level curves are followed."""
        return Monotone.of(self.names, self.bounds, self.values, self._hermite)

    @property
    def spans(self) -> Array:
        """Smallest and largest value of every output at the nodes, shape (L, 2)."""
        axes = tuple(range(len(self.names)))
        return np.stack([self.values.min(axes), self.values.max(axes)], axis=-1)

    @property
    def errors(self) -> Array:
        """Interpolation errors at the nodes of an axis that are left out if only every other is used, (n, L).

        The error of the surface itself is smaller by a factor of two at kinks, and of about ten where the
        response is smooth.
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
        """Values, each followed by its slope per cell along every axis, shape (2 m_1, ..., 2 m_n, L)."""
        table = self.values
        for axis, nodes in enumerate(self.values.shape[:-1]):
            along = np.moveaxis(table, axis, 0)
            pairs = np.stack([along, _slopes(along, np.arange(float(nodes)))], axis=1)
            table = np.moveaxis(pairs.reshape(2 * nodes, *along.shape[1:]), 0, axis)
        return table

    def _block(self, share: Array) -> Array:
        """Return outputs (S, L) at points (S, n) of the unit box, by a sparse product with `_hermite`."""
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
    """Return Hermite polynomials (S, 4) at places (S,) in a cell: of value and slope at its start and end."""
    y = 1.0 - x
    return np.stack([(1.0 + 2.0 * x) * y * y, x * y * y, (1.0 + 2.0 * y) * x * x, -y * x * x], axis=1)


def _slopes(values: Array, x: Array) -> Array:
    """Return Akima's slopes of values (m, ...) at x (m,), limited for a monotone interpolation."""
    free = Akima1DInterpolator(x, values).derivative()(x)
    secants = np.diff(values, axis=0) / np.diff(x).reshape(-1, *[1] * (values.ndim - 1))
    before, after = np.concatenate([secants[:1], secants]), np.concatenate([secants, secants[-1:]])
    limit = STEEPEST * np.minimum(np.abs(before), np.abs(after))
    kept = np.sign(before) * np.clip(np.sign(before) * free, 0.0, limit)
    return np.asarray(np.where(before * after > 0.0, kept, 0.0))
