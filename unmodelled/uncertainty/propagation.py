"""Ways from the distribution of the parameters to the densities of the outputs (section 3.2.7, figure 3.2).

Each is a function of alpha (n, 2), the numbers of the parameters' families.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import comb
from typing import Protocol, final

import numpy as np
from numpy.typing import NDArray

from unmodelled.base.errors import BadInput
from unmodelled.uncertainty.chaos import Chaos
from unmodelled.uncertainty.density import Density
from unmodelled.uncertainty.empirical import Empirical
from unmodelled.uncertainty.families import Family
from unmodelled.uncertainty.gaussian import Gaussian
from unmodelled.uncertainty.histogram import Histogram
from unmodelled.uncertainty.maximum_entropy import MaximumEntropy
from unmodelled.uncertainty.push_forward import PushForward
from unmodelled.uncertainty.response import Response, checked
from unmodelled.uncertainty.sampling import draw, even_grid
from unmodelled.uncertainty.surface import ResponseSurface

Array = NDArray[np.float64]

#: Samples whose outputs are kept at a time.
BLOCK = 20_000


class Propagation(Protocol):
    """Densities of all outputs for a distribution of the parameters.

    Raises BadInput for an alpha that a family does not have, and where an output does not exist.
    """

    def __call__(self, alpha: Array) -> Density: ...


@final
@dataclass(frozen=True)
class ChaosGaussian:
    """Gaussians with the mean and variance of polynomial chaos."""

    response: Response
    chaos: Chaos

    def __call__(self, alpha: Array) -> Gaussian:
        expansion = self.chaos.expand(alpha, checked(self.response, self.chaos.nodes(alpha)))
        return Gaussian(expansion.mean, np.sqrt(expansion.variance))


@final
@dataclass(frozen=True, eq=False)
class ChaosMaximumEntropy:
    """Densities of largest entropy with the first `moments` moments of polynomial chaos.

    `support` (L, 2) is where the outputs can lie, such as `ResponseSurface.spans`; without it, anywhere.
    """

    response: Response
    chaos: Chaos
    moments: int = 4
    support: Array | None = None

    def __call__(self, alpha: Array) -> MaximumEntropy:
        expansion = self.chaos.expand(alpha, checked(self.response, self.chaos.nodes(alpha)))
        return MaximumEntropy.fit(
            expansion.mean,
            np.sqrt(expansion.variance),
            expansion.standardised(self.moments),
            self.support,
        )


@final
@dataclass(frozen=True)
class ExactPushForward:
    """The densities themselves, of a response that is monotone along one of its parameters at least."""

    surface: ResponseSurface
    families: tuple[Family, ...]

    def __call__(self, alpha: Array) -> PushForward:
        return PushForward(self.surface, self.families, alpha)


@final
@dataclass(frozen=True)
class MonteCarlo:
    """Histograms of random samples; the same random numbers for every alpha, so that it varies smoothly."""

    response: Response
    families: tuple[Family, ...]
    samples: int
    seed: int

    def outputs(self, alpha: Array) -> Iterator[Array]:
        """Blocks (., L) of samples."""
        generator = np.random.default_rng(self.seed)
        return _outputs(self.response, draw(self.families, alpha, self.samples, generator))

    def __call__(self, alpha: Array) -> Empirical:
        return _empirical(self.outputs(alpha))


@final
@dataclass(frozen=True)
class QuasiMonteCarlo:
    """Histograms of the outputs on `even_grid`, with a number of samples near to `samples`."""

    response: Response
    families: tuple[Family, ...]
    samples: int

    def outputs(self, alpha: Array) -> Iterator[Array]:
        """Blocks (., L) of samples."""
        return _outputs(self.response, even_grid(self.families, alpha, self.samples))

    def __call__(self, alpha: Array) -> Empirical:
        return _empirical(self.outputs(alpha))


def of_moments(
    blocks: Iterable[Array], count: int, support: Array | None = None
) -> Gaussian | MaximumEntropy:
    """Densities from moments "extracted from the sample set" (figure 3.12), not from chaos.

    Two moments give Gaussians, more of them densities of largest entropy with `support` (L, 2).

    Args:
        blocks: samples (., L). count: of moments.

    Raises BadInput as `sample_moments` does.
    """
    mean, std, moments = sample_moments(blocks, count)
    return Gaussian(mean, std) if count == 2 else MaximumEntropy.fit(mean, std, moments, support)


def sample_moments(blocks: Iterable[Array], count: int) -> tuple[Array, Array, Array]:
    """Of samples that come in blocks (., L).

    Powers are summed of the distance from the first block's mean, in its standard deviations, and moved to
    the mean of all at the end: nothing cancels, and no sample is kept.

    Returns:
        (L,) means, (L,) standard deviations, (count, L) standardised moments 1 to count.

    Raises BadInput for fewer than two moments, and where an output's first samples are all equal.
    """
    if count < 2:
        raise BadInput(f"moments: at least 2, got {count}")
    size, centre, scale, sums = 0, np.empty(0), np.empty(0), np.empty(0)
    for y in blocks:
        if not size:
            centre, scale = y.mean(0), y.std(0)
            sums = np.zeros((count + 1, y.shape[1]))
            if not scale.all():
                raise BadInput(f"samples of output {np.argmin(scale) + 1} of {scale.size} are all equal")
        z = (y - centre) / scale
        power = np.ones_like(z)
        for k in range(count + 1):
            sums[k] += power.sum(0)
            power *= z
        size += len(y)
    mean, std, moments = standardised(sums / size)
    return centre + scale * mean, scale * std, moments


def standardised(raw: Array) -> tuple[Array, Array, Array]:
    """From raw moments (count + 1, L) of the orders 0 to count.

    Returns:
        (L,) means, (L,) standard deviations, (count, L) standardised moments 1 to count.
    """
    count = len(raw) - 1
    central = [
        sum(comb(k, j) * raw[j] * (-raw[1]) ** (k - j) for j in range(k + 1)) for k in range(count + 1)
    ]
    std = np.sqrt(central[2])
    return raw[1], std, np.stack([central[k] / std**k for k in range(1, count + 1)])


def _outputs(response: Response, theta: Array) -> Iterator[Array]:
    for i in range(0, len(theta), BLOCK):
        yield checked(response, theta[i : i + BLOCK])


def _empirical(blocks: Iterable[Array]) -> Empirical:
    histogram = Histogram()
    for y in blocks:
        histogram.add(y)
    return Empirical.from_histogram(histogram)
