"""Samples of uncertain parameters, and of synthetic data."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.uncertainty.families import Family
from unmodelled.uncertainty.response import Response, evaluate_response


def draw(families: Sequence[Family], alpha: Array, count: int, generator: np.random.Generator) -> Array:
    """Draw random samples (count, n) of n independent parameters from a distribution (n, 2)."""
    _check(families, alpha, count)
    return _quantiles(families, alpha, generator.random((count, len(families))))


def even_grid(families: Sequence[Family], alpha: Array, count: int) -> Array:
    """Return samples (m^n, n) in the centres of cells of equal probability of a distribution (n, 2).

    This is the "equally distributed grid of S samples" of quasi Monte Carlo (section 3.4.3).
    """
    _check(families, alpha, count)
    n = len(families)
    fewer = int(count ** (1.0 / n) + 1e-9)
    per_axis = min((fewer, fewer + 1), key=lambda m: abs(m**n - count))
    middles = (np.arange(per_axis) + 0.5) / per_axis
    grid = np.meshgrid(*[middles] * n, indexing="ij")
    return _quantiles(families, alpha, np.stack([axis.ravel() for axis in grid], axis=1))


def data_sets(
    response: Response,
    families: Sequence[Family],
    alpha: Array,
    outputs: int,
    count: int,
    generator: np.random.Generator,
) -> Array:
    """Draw data sets (count, L), in which every output has its own parameters (section 3.2.1)."""
    theta = draw(families, alpha, count * outputs, generator).reshape(count, outputs, -1)
    return np.stack([np.diagonal(evaluate_response(response, own)) for own in theta])


def _quantiles(families: Sequence[Family], alpha: Array, probability: Array) -> Array:
    columns = [f.quantile(p, a) for f, a, p in zip(families, alpha, probability.T, strict=True)]
    return np.stack(columns, axis=1)


def _check(families: Sequence[Family], alpha: Array, count: int) -> None:
    if count < 1:
        raise BadInput(f"samples must be at least 1, got {count}")
    for family, two in zip(families, alpha, strict=True):
        family.check(two)
