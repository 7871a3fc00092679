"""Methods that propagate a parameter distribution to the densities of the outputs (section 3.2.7, figure
3.2).

Each method is a function of alpha of shape (n, 2), the parameters of the n distributions.
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
from unmodelled.uncertainty.density import Density, GaussianDensity
from unmodelled.uncertainty.empirical import Empirical, Histogram
from unmodelled.uncertainty.families import Family
from unmodelled.uncertainty.maximum_entropy import MaximumEntropy
from unmodelled.uncertainty.push_forward import PushForward
from unmodelled.uncertainty.response import Response, evaluate_response
from unmodelled.uncertainty.sampling import draw, even_grid
from unmodelled.uncertainty.surface import ResponseSurface

Array = NDArray[np.float64]

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
    """Propagation to Gaussians with the mean and variance of polynomial chaos.

    Attributes:
        response: outputs as a function of the parameters.
        chaos: polynomial chaos expansion.

    Examples:
        >>> from unmodelled.uncertainty.families import Gaussian
        >>> from unmodelled.uncertainty.response import Formula
        >>> double = Formula(("theta",), np.array([[-9.0, 9.0]]), lambda theta: 2.0 * theta)
        >>> density = ChaosGaussian(double, Chaos((Gaussian(),), 1, 2))(np.array([[1.0, 0.3]]))
        >>> density.mean.round(6).tolist(), density.std.round(6).tolist()
        ([2.0], [0.6])
    """

    response: Response
    chaos: Chaos

    def __call__(self, alpha: Array) -> GaussianDensity:
        expansion = self.chaos.expand(alpha, evaluate_response(self.response, self.chaos.nodes(alpha)))
        return GaussianDensity(expansion.mean, np.sqrt(expansion.variance))


@final
@dataclass(frozen=True, eq=False)
class ChaosMaximumEntropy:
    """Propagation to densities of largest entropy with the first moments of polynomial chaos.

    Attributes:
        response: outputs as a function of the parameters.
        chaos: polynomial chaos expansion.
        moments: number of moments; default 4.
        support: intervals that can hold the outputs, shape (L, 2), such as `ResponseSurface.spans`; default
            None: unknown.
    """

    response: Response
    chaos: Chaos
    moments: int = 4
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
    """Propagation to exact densities, of a response that is monotone along one of its parameters at least.

    Attributes:
        surface: interpolated response.
        families: families of the n independent parameters.
    """

    surface: ResponseSurface
    families: tuple[Family, ...]

    def __call__(self, alpha: Array) -> PushForward:
        return PushForward(self.surface, self.families, alpha)


@final
@dataclass(frozen=True)
class MonteCarlo:
    """Propagation to histograms of random samples.

    Every alpha uses the same random numbers, so that the density varies smoothly with alpha.

    Attributes:
        response: outputs as a function of the parameters.
        families: families of the n independent parameters.
        samples: number of samples S.
        seed: seed of the random generator.
    """

    response: Response
    families: tuple[Family, ...]
    samples: int
    seed: int

    def outputs(self, alpha: Array) -> Iterator[Array]:
        """Yield the outputs of the samples in blocks.

        Takes alpha (n, 2); gives (block, L).
        """
        generator = np.random.default_rng(self.seed)
        return _outputs(self.response, draw(self.families, alpha, self.samples, generator))

    def __call__(self, alpha: Array) -> Empirical:
        return _empirical(self.outputs(alpha))


@final
@dataclass(frozen=True)
class QuasiMonteCarlo:
    """Propagation to histograms of the outputs on an even grid of probabilities (`even_grid`).

    Attributes:
        response: outputs as a function of the parameters.
        families: families of the n independent parameters.
        samples: approximate number of samples.
    """

    response: Response
    families: tuple[Family, ...]
    samples: int

    def outputs(self, alpha: Array) -> Iterator[Array]:
        """Yield the outputs of the samples in blocks.

        Takes alpha (n, 2); gives (block, L).
        """
        return _outputs(self.response, even_grid(self.families, alpha, self.samples))

    def __call__(self, alpha: Array) -> Empirical:
        return _empirical(self.outputs(alpha))


def of_moments(
    blocks: Iterable[Array], count: int, support: Array | None = None
) -> GaussianDensity | MaximumEntropy:
    """Return densities with the moments of samples (figure 3.12) instead of those of polynomial chaos.

    Takes blocks (block, L), support (L, 2).
    """
    mean, std, moments = sample_moments(blocks, count)
    return GaussianDensity(mean, std) if count == 2 else MaximumEntropy.fit(mean, std, moments, support)


def sample_moments(blocks: Iterable[Array], count: int) -> tuple[Array, Array, Array]:
    """Compute moments of samples that arrive in blocks.

    Powers of the distance from the first block's mean, in its standard deviations, are summed and shifted to
    the mean of all samples at the end: no cancellation occurs, and no sample is stored.

    Takes blocks (block, L); gives (L,) and (L,) and (count, L).

    Examples:
        >>> mean, std, moments = sample_moments([np.array([[0.0], [1.0]]), np.array([[2.0], [3.0]])], 4)
        >>> mean.tolist(), std.round(4).tolist(), moments[3].round(2).tolist()
        ([1.5], [1.118], [1.64])
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
    """Convert raw moments to standardised moments.

    Takes raw (count + 1, L); gives (L,) and (L,) and (count, L).

    Examples:
        >>> mean, std, moments = standardised(np.array([[1.0], [2.0], [5.0]]))
        >>> mean.tolist(), std.tolist(), moments.tolist()
        ([2.0], [1.0], [[0.0], [1.0]])
    """
    count = len(raw) - 1
    central = [
        sum(comb(k, j) * raw[j] * (-raw[1]) ** (k - j) for j in range(k + 1)) for k in range(count + 1)
    ]
    std = np.sqrt(central[2])
    return raw[1], std, np.stack([central[k] / std**k for k in range(1, count + 1)])


def _outputs(response: Response, theta: Array) -> Iterator[Array]:
    for i in range(0, len(theta), BLOCK):
        yield evaluate_response(response, theta[i : i + BLOCK])


def _empirical(blocks: Iterable[Array]) -> Empirical:
    histogram = Histogram()
    for y in blocks:
        histogram.add(y)
    return Empirical.from_histogram(histogram)
