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
    check_samples(families, alpha, count)
    return quantiles(families, alpha, generator.random((count, len(families))))


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


def quantiles(families: Sequence[Family], alpha: Array, probability: Array) -> Array:
    """Return samples (S, n) at probabilities (S, n) of a distribution (n, 2)."""
    columns = [f.quantile(p, a) for f, a, p in zip(families, alpha, probability.T, strict=True)]
    return np.stack(columns, axis=1)


def check_samples(families: Sequence[Family], alpha: Array, count: int) -> None:
    """Refuse a count below one, and a distribution (n, 2) that a family does not have."""
    if count < 1:
        raise BadInput(f"samples must be at least 1, got {count}")
    for family, two in zip(families, alpha, strict=True):
        family.check(two)
