"""Methods that propagate a parameter distribution to the densities of the outputs (section 3.2.7, figure
3.2).

Each method is a function of alpha of shape (n, 2), the parameters of the n distributions.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, final

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.uncertainty.chaos import Chaos
from unmodelled.uncertainty.density import Density, GaussianDensity
from unmodelled.uncertainty.families import Family
from unmodelled.uncertainty.maximum_entropy import MaximumEntropy
from unmodelled.uncertainty.push_forward import PushForward
from unmodelled.uncertainty.response import Response, evaluate_response
from unmodelled.uncertainty.surface import ResponseSurface


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

    def __call__(self, alpha: Array) -> MaximumEntropy:
        expansion = self.chaos.expand(alpha, evaluate_response(self.response, self.chaos.nodes(alpha)))
        std, moments = np.sqrt(expansion.variance), expansion.standardised(self.moments)
        return MaximumEntropy.fit(expansion.mean, std, moments)


@final
@dataclass(frozen=True)
class ExactPushForward:
    """Propagation to exact densities, of a response that is monotone along a parameter at least."""

    surface: ResponseSurface
    families: tuple[Family, ...]

    def __call__(self, alpha: Array) -> PushForward:
        return PushForward(self.surface, self.families, alpha)
