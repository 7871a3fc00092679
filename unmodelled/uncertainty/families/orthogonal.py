"""Standard variables of polynomial chaos with their orthonormal polynomials and Gauss quadratures."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import final

import numpy as np
from scipy.special import roots_legendre

from unmodelled.base.arrays import Array
from unmodelled.base.compiling import kept

#: Of a recurrence without a formula, computed at a time.
TERMS = 16


class Germ(ABC):
    """Standard variable phi and the polynomials h_0 = 1, h_1, ... orthonormal under its density (eq. 3.7).

    The polynomials follow x h_k = b_k h_{k-1} + a_k h_k + b_{k+1} h_{k+1}. Germs compare by value: results
    for equal germs are computed once.
    """

    @property
    @abstractmethod
    def support(self) -> tuple[float, float]:
        """Smallest and largest phi."""

    @abstractmethod
    def density(self, phi: Array) -> Array:
        """Return the density inside the support.

        Args:
            phi: values of the standard variable, any shape.

        Returns:
            Densities, of the shape of phi.
        """

    @abstractmethod
    def recurrence(self, count: int) -> tuple[Array, Array]:
        """Return the coefficients of the three-term recurrence.

        Args:
            count: number of coefficients.

        Returns:
            Coefficients a_0, a_1, ... of shape (count,) and b_1, b_2, ... of shape (count,).
        """

    def polynomials(self, phi: Array, degree: int) -> Array:
        """Evaluate the orthonormal polynomials.

        Args:
            phi: values of the standard variable, any shape (...).
            degree: largest degree.

        Returns:
            Values of h_0 to h_degree, shape (degree + 1, ...).

        Examples:
            >>> Hermite().polynomials(np.array([2.0]), 2).round(4).tolist()
            [[1.0], [2.0], [2.1213]]
        """
        diagonal, beside = self.recurrence(degree)
        h = np.ones((degree + 1, *np.shape(phi)))
        for k in range(degree):
            h[k + 1] = (phi - diagonal[k]) * h[k]
            if k > 0:
                h[k + 1] -= beside[k - 1] * h[k - 1]
            h[k + 1] /= beside[k]
        return h

    def quadrature(self, order: int) -> tuple[Array, Array]:
        """Return the Gauss quadrature rule, which is exact for polynomials of degree 2 order - 1.

        The points are the zeros of h_order (Golub and Welsch). A weight is one over the sum of the squared
        h_k, which is accurate for the smallest weights, too.

        Args:
            order: number of points.

        Returns:
            Points of shape (order,) and weights of shape (order,), with sum 1.

        Examples:
            >>> points, weights = Hermite().quadrature(3)
            >>> (points.round(4) + 0.0).tolist(), weights.round(4).tolist()
            ([-1.7321, 0.0, 1.7321], [0.1667, 0.6667, 0.1667])
        """
        diagonal, beside = self.recurrence(order)
        nodes = np.asarray(np.linalg.eigvalsh(np.diag(diagonal) + np.diag(beside[:-1], -1)), dtype=float)
        weights: Array = 1.0 / np.sum(self.polynomials(nodes, order - 1) ** 2, axis=0)
        return nodes, weights


@final
@dataclass(frozen=True)
class Hermite(Germ):
    """Standard normal variable with the Hermite polynomials."""

    @property
    def support(self) -> tuple[float, float]:
        return -np.inf, np.inf

    def density(self, phi: Array) -> Array:
        return np.asarray(np.exp(-0.5 * np.square(phi)) / np.sqrt(2.0 * np.pi))

    def recurrence(self, count: int) -> tuple[Array, Array]:
        return np.zeros(count), np.sqrt(np.arange(1.0, count + 1))


@final
@dataclass(frozen=True)
class TruncatedHermite(Germ):
    """Truncated normal variable, in standard deviations of the whole normal from its mode.

    The density is proportional to exp(-phi (phi / 2 + slope)) on [low, high]. Its polynomials have no name.
    """

    slope: float  # distance from the mean to the mode; zero if the mean lies inside the interval
    low: float  # at most 0
    high: float  # at least 0

    @property
    def support(self) -> tuple[float, float]:
        return self.low, self.high

    def density(self, phi: Array) -> Array:
        _, weights = self.measure(1)
        return np.asarray(np.exp(-phi * (0.5 * phi + self.slope)) / np.sum(weights))

    def recurrence(self, count: int) -> tuple[Array, Array]:
        diagonal, beside = _truncated_recurrence(self, TERMS * -(-count // TERMS))
        return diagonal[:count], beside[:count]

    def measure(self, count: int) -> tuple[Array, Array]:
        """Return Gauss-Legendre points (Q,) and weights (Q,) of the density, without negligible tails."""
        least = 40.0 + 4.0 * count  # exp(-least) of the mode's density
        low = max(self.low, -_reach(least, -self.slope))
        high = min(self.high, _reach(least, self.slope))
        points, weights = gauss_legendre(64 + 4 * count)
        points = 0.5 * (low + high) + 0.5 * (high - low) * points
        return points, 0.5 * (high - low) * weights * np.exp(-points * (0.5 * points + self.slope))


@lru_cache(maxsize=64)
def _truncated_recurrence(germ: TruncatedHermite, count: int) -> tuple[Array, Array]:
    """Return the recurrence, computed once for the coefficients and the moments of an expansion."""
    points, weights = germ.measure(count)
    diagonal, beside = np.empty(count), np.empty(count)
    _stieltjes(points, weights, diagonal, beside)
    return diagonal, beside


def _reach(least: float, slope: float) -> float:
    """Return the positive root of x (x / 2 + slope) = least."""
    root = float(np.sqrt(slope**2 + 2.0 * least))
    return 2.0 * least / (root + slope) if slope > 0.0 else root - slope


@lru_cache
def gauss_legendre(nodes: int) -> tuple[Array, Array]:
    """Return the points (n,) and weights (n,) of a Gauss-Legendre quadrature rule on [-1, 1]."""
    points, weights = roots_legendre(nodes)
    return points, weights


def _procedure_of_stieltjes(points: Array, weights: Array, diagonal: Array, beside: Array) -> None:
    """Compute in place the recurrence of the polynomials that are orthonormal under weights at points."""
    weights = weights / np.sum(weights)
    previous, h, last = np.zeros_like(points), np.ones_like(points), 0.0
    for k in range(len(diagonal)):
        diagonal[k] = np.sum(weights * points * h**2)
        following = (points - diagonal[k]) * h - last * previous
        last = np.sqrt(np.sum(weights * following**2))
        beside[k] = last
        previous, h = h, following / last


_stieltjes: Callable[[Array, Array, Array, Array], None] = kept(nogil=True)(_procedure_of_stieltjes)
