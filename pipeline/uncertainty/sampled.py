"""Densities from random samples, and from samples on an even grid."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from pipeline.uncertainty.empirical import Empirical, Histogram
from unmodelled.base.arrays import Array
from unmodelled.uncertainty.families import Family
from unmodelled.uncertainty.response import Response, evaluate_response
from unmodelled.uncertainty.sampling import check_samples, draw, quantiles

#: Samples whose outputs are kept at a time.
BLOCK = 20_000


@dataclass(frozen=True)
class _Sampled(ABC):
    """Propagation to histograms of the outputs of samples."""

    response: Response
    families: tuple[Family, ...]
    samples: int

    @abstractmethod
    def theta(self, alpha: Array) -> Array:
        """Return the samples (S, n) for a distribution (n, 2)."""

    def outputs(self, alpha: Array) -> Iterator[Array]:
        """Yield the outputs (block, L) of the samples for a distribution (n, 2)."""
        theta = self.theta(alpha)
        for i in range(0, len(theta), BLOCK):
            yield evaluate_response(self.response, theta[i : i + BLOCK])

    def __call__(self, alpha: Array) -> Empirical:
        histogram = Histogram()
        for y in self.outputs(alpha):
            histogram.add(y)
        return Empirical.from_histogram(histogram)


@final
@dataclass(frozen=True)
class MonteCarlo(_Sampled):
    """Propagation to histograms of random samples.

    Every alpha uses the same random numbers, so that the density varies smoothly with alpha.
    """

    seed: int

    def theta(self, alpha: Array) -> Array:
        return draw(self.families, alpha, self.samples, np.random.default_rng(self.seed))


@final
@dataclass(frozen=True)
class QuasiMonteCarlo(_Sampled):
    """Propagation to histograms of the outputs on an even grid of about `samples` probabilities."""

    def theta(self, alpha: Array) -> Array:
        return even_grid(self.families, alpha, self.samples)


def even_grid(families: Sequence[Family], alpha: Array, count: int) -> Array:
    """Return samples (m^n, n) in the centres of cells of equal probability of a distribution (n, 2).

    This is the "equally distributed grid of S samples" of quasi Monte Carlo (section 3.4.3).
    """
    check_samples(families, alpha, count)
    n = len(families)
    fewer = int(count ** (1.0 / n) + 1e-9)
    per_axis = min((fewer, fewer + 1), key=lambda m: abs(m**n - count))
    middles = (np.arange(per_axis) + 0.5) / per_axis
    grid = np.meshgrid(*[middles] * n, indexing="ij")
    return quantiles(families, alpha, np.stack([axis.ravel() for axis in grid], axis=1))
