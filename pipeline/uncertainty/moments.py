"""Moments of samples, and the densities that they give."""

from __future__ import annotations

from collections.abc import Iterable
from math import comb

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.uncertainty.density import GaussianDensity
from unmodelled.uncertainty.maximum_entropy import MaximumEntropy


def of_moments(blocks: Iterable[Array], count: int) -> GaussianDensity | MaximumEntropy:
    """Return densities with the moments of samples (block, L) (figure 3.12), not of polynomial chaos."""
    mean, std, moments = sample_moments(blocks, count)
    return GaussianDensity(mean, std) if count == 2 else MaximumEntropy.fit(mean, std, moments)


def sample_moments(blocks: Iterable[Array], count: int) -> tuple[Array, Array, Array]:
    """Compute mean (L,), std (L,) and moments (count, L) of samples that arrive in blocks (block, L).

    Powers of the distance from the first block's mean, in its standard deviations, are summed and shifted to
    the mean of all samples at the end: no cancellation occurs, and no sample is stored.
    """
    if count < 2:
        raise BadInput(f"moments must be at least 2, got {count}")
    size, centre, scale, sums = 0, np.empty(0), np.empty(0), np.empty(0)
    for y in blocks:
        if not size:
            centre, scale = y.mean(0), y.std(0)
            sums = np.zeros((count + 1, y.shape[1]))
            if not scale.all():
                raise BadInput(
                    f"samples of output {np.argmin(scale) + 1} of {scale.size} are all equal: no "
                    "parameter changes it"
                )
        z = (y - centre) / scale
        power = np.ones_like(z)
        for k in range(count + 1):
            sums[k] += power.sum(0)
            power *= z
        size += len(y)
    mean, std, moments = standardised(sums / size)
    return centre + scale * mean, scale * std, moments


def standardised(raw: Array) -> tuple[Array, Array, Array]:
    """Convert raw moments (count + 1, L) to mean (L,), std (L,) and standardised moments (count, L)."""
    count = len(raw) - 1
    central = [
        sum(comb(k, j) * raw[j] * (-raw[1]) ** (k - j) for j in range(k + 1)) for k in range(count + 1)
    ]
    std = np.sqrt(central[2])
    return raw[1], std, np.stack([central[k] / std**k for k in range(1, count + 1)])
