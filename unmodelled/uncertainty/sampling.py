"""Samples of the uncertain parameters, and of data that they make."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from unmodelled.base.errors import BadInput
from unmodelled.uncertainty.families import Family
from unmodelled.uncertainty.response import Response, checked

Array = NDArray[np.float64]


def draw(families: Sequence[Family], alpha: Array, count: int, generator: np.random.Generator) -> Array:
    """(count, n) random samples of n independent parameters.

    Args:
        alpha: (n, 2) the two numbers of every family.

    Raises BadInput for an alpha that a family does not have, or a count below one.
    """
    _check(families, alpha, count)
    return _quantiles(families, alpha, generator.random((count, len(families))))


def even_grid(families: Sequence[Family], alpha: Array, count: int) -> Array:
    """(m^n, n) samples in the middle of cells of equal probability, with m^n as near to `count` as it can be.

    The "equally distributed grid of S samples" of quasi Monte Carlo (section 3.4.3).

    Raises BadInput as `draw` does.
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
    """(count, L) made-up data: every output of every set comes from a theta of its own (section 3.2.1).

    Args:
        response: of L outputs, L being `outputs`; called with L samples for every set.

    Raises BadInput as `draw` does, and where an output does not exist at a sample.
    """
    theta = draw(families, alpha, count * outputs, generator).reshape(count, outputs, -1)
    return np.stack([np.diagonal(checked(response, own)) for own in theta])


def _quantiles(families: Sequence[Family], alpha: Array, probability: Array) -> Array:
    columns = [f.quantile(p, a) for f, a, p in zip(families, alpha, probability.T, strict=True)]
    return np.stack(columns, axis=1)


def _check(families: Sequence[Family], alpha: Array, count: int) -> None:
    if count < 1:
        raise BadInput(f"samples: at least one, got {count}")
    for family, two in zip(families, alpha, strict=True):
        family.check(two)
