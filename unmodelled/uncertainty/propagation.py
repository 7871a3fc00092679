"""Methods that propagate a parameter distribution to the densities of the outputs (section 3.2.7, figure
3.2).

Each method is a function of alpha of shape (n, 2), the parameters of the n distributions.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import comb
from typing import Protocol, final

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.uncertainty.chaos import Chaos
from unmodelled.uncertainty.density import Density, GaussianDensity
from unmodelled.uncertainty.empirical import Empirical, Histogram
from unmodelled.uncertainty.families import Family
from unmodelled.uncertainty.maximum_entropy import MaximumEntropy
from unmodelled.uncertainty.push_forward import PushForward
from unmodelled.uncertainty.response import Response, evaluate_response
from unmodelled.uncertainty.sampling import draw, even_grid
from unmodelled.uncertainty.surface import ResponseSurface

#: Samples whose outputs are kept at a time.
BLOCK = 20_000


class Propagation(Protocol):
    """Function from a parameter distribution to the densities of all outputs."""

    def __call__(self, alpha: Array) -> Density:
        """Return the densities of the outputs for alpha of shape (n, 2).

        Raises:
            BadInput: if a family has no distribution alpha, or if an output does not exist.
        """


@final
@dataclass(frozen=True)
class ChaosGaussian:
    """Propagation to Gaussians with the mean and variance of polynomial chaos."""

    response: Response
    chaos: Chaos

    def __call__(self, alpha: Array) -> GaussianDensity:
        expansion = self.chaos.expand(alpha, evaluate_response(self.response, self.chaos.nodes(alpha)))
        return GaussianDensity(expansion.mean, np.sqrt(expansion.variance))


@final
@dataclass(frozen=True, eq=False)
class ChaosMaximumEntropy:
    """Propagation to densities of largest entropy with the first moments of polynomial chaos."""

    response: Response
    chaos: Chaos
    moments: int = 4  # number of them
    #: (L, 2), intervals that can hold the outputs, such as `ResponseSurface.spans`.
    support: Array | None = None

    def __call__(self, alpha: Array) -> MaximumEntropy:
        expansion = self.chaos.expand(alpha, evaluate_response(self.response, self.chaos.nodes(alpha)))
        return MaximumEntropy.fit(
            expansion.mean,
            np.sqrt(expansion.variance),
            expansion.standardised(self.moments),
            self.support,
        )


@final
@dataclass(frozen=True)
class ExactPushForward:
    """Propagation to exact densities, of a response that is monotone along a parameter at least."""

    surface: ResponseSurface
    families: tuple[Family, ...]

    def __call__(self, alpha: Array) -> PushForward:
        return PushForward(self.surface, self.families, alpha)


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


def of_moments(
    blocks: Iterable[Array], count: int, support: Array | None = None
) -> GaussianDensity | MaximumEntropy:
    """Return densities with the moments of samples (block, L) (figure 3.12), not of polynomial chaos."""
    mean, std, moments = sample_moments(blocks, count)
    return GaussianDensity(mean, std) if count == 2 else MaximumEntropy.fit(mean, std, moments, support)


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
