"""Integrals of exponentials of polynomials, compiled, for many outputs."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from scipy.special import roots_legendre

from unmodelled.base.compiling import compiled
from unmodelled.uncertainty.density import Array

#: Panels of an interval, and Gauss-Legendre nodes in each or in the part of it that is asked for.
PANELS, NODES = 128, 12


@lru_cache
def rule(nodes: int) -> tuple[Array, Array]:
    """Gauss-Legendre nodes and weights on [-1, 1]."""
    points, weights = roots_legendre(nodes)
    return points, weights


def table(coefficients: Array, support: Array) -> Array:
    """Integrals from the lower end to the ends of all panels.

    Args:
        coefficients: (L, K + 1) c of exp(sum c_k z^k). support: (L, 2) ends of the interval of z.

    Returns:
        (L, PANELS + 1), the first column zero.
    """
    panels: Array = _panels(coefficients, support, *rule(NODES))
    return np.asarray(np.cumsum(panels, -1))


def integral(coefficients: Array, support: Array, sums: Array, z: Array) -> Array:
    """Integrals from the lower end up to `z` (points, L), with the `table` of the same density."""
    return np.asarray(_integral(coefficients, support, sums, np.ascontiguousarray(z), *rule(NODES)))


@compiled
def polynomial(c: Array, z: float) -> float:
    """sum c_k z^k."""
    value = 0.0
    for k in range(c.size - 1, -1, -1):
        value = value * z + c[k]
    return value


@compiled
def _between(c: Array, low: float, high: float, nodes: Array, weights: Array) -> float:
    half, total = 0.5 * (high - low), 0.0
    for i in range(nodes.size):
        total += weights[i] * np.exp(polynomial(c, low + half * (nodes[i] + 1.0)))
    return half * total


@compiled
def _panels(coefficients: Array, support: Array, nodes: Array, weights: Array) -> Any:
    values = np.zeros((len(coefficients), PANELS + 1))
    for l in range(len(coefficients)):
        low, width = support[l, 0], (support[l, 1] - support[l, 0]) / PANELS
        for k in range(PANELS):
            start = low + k * width
            values[l, k + 1] = _between(coefficients[l], start, start + width, nodes, weights)
    return values


@compiled
def _integral(
    coefficients: Array, support: Array, sums: Array, z: Array, nodes: Array, weights: Array
) -> Any:
    values = np.full_like(z, np.nan)
    for i in range(z.shape[0]):
        for l in range(z.shape[1]):
            if np.isnan(z[i, l]):
                continue
            low, high = support[l]
            width = (high - low) / PANELS
            place = min(max(z[i, l], low), high)
            k = min(int((place - low) / width), PANELS - 1)
            part = _between(coefficients[l], low + k * width, place, nodes, weights)
            values[i, l] = sums[l, k] + part
    return values
