"""Settings of an inverse uncertainty identification: a file of conf/uncertainty/."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.uncertainty.chaos import Chaos
from unmodelled.uncertainty.families import Family
from unmodelled.uncertainty.identify import Settings
from unmodelled.uncertainty.likelihood import TAIL
from unmodelled.uncertainty.methods import GAUSSIAN, MAXIMUM_ENTROPY, PUSH_FORWARD
from unmodelled.uncertainty.propagation import (
    ChaosGaussian,
    ChaosMaximumEntropy,
    ExactPushForward,
    Propagation,
)
from unmodelled.uncertainty.response import Response
from unmodelled.uncertainty.surface import ResponseSurface


@dataclass(frozen=True)
class Setup:
    """Structure of the parameter distribution, and settings of the methods that propagate it.

    Attributes:
        family: constructor of a family of distributions from the ends of a parameter's bounds.
        deviations: lower and upper bound of the second distribution parameter, in units of the nominal
            parameter; the first distribution parameter has the bounds of the parameter.
        degree: degree d of polynomial chaos (section 3.2.7); default 4.
        order: order q of the quadrature of polynomial chaos (section 3.2.7); default 5.
        moments: number m of moments of maximum entropy (section 3.2.7); default 4.
        nodes: number of nodes of the response surface per parameter; one number stands for all parameters;
            default 11.
        tail: probability in a tail of the distribution that sets the floor of log-densities; see
            `tail_floor`.
        search: settings of the global optimiser.

    Raises:
        BadInput: when the bounds `deviations` are not positive and increasing.
    """

    family: Callable[[float, float], Family]
    deviations: tuple[float, float]
    degree: int = 4
    order: int = 5
    moments: int = 4
    nodes: tuple[int, ...] = (11,)
    tail: float = TAIL
    search: Settings = field(default_factory=Settings)

    def __post_init__(self) -> None:
        low, high = self.deviations
        if not 0.0 < low < high:
            raise BadInput(f"deviations: must be positive and increase, got [{low:g}, {high:g}]")

    def families(self, response: Response) -> tuple[Family, ...]:
        """Return one family per parameter of a response.

        Args:
            response: response of n parameters.
        """
        return tuple(self.family(float(low), float(high)) for low, high in response.bounds)

    def names(self, response: Response) -> tuple[str, ...]:
        """Return the names of the 2 n distribution parameters, in the order mu_1, ..., sigma_1, ...

        Args:
            response: response of n parameters.
        """
        families = self.families(response)
        return tuple(f"{family.names[k]}_{i}" for k in range(2) for i, family in enumerate(families, start=1))

    def bounds(self, response: Response) -> Array:
        """Return the bounds of the distribution parameters.

        Args:
            response: response of n parameters.

        Returns:
            Lower and upper bounds, shape (2 n, 2).
        """
        return np.concatenate([response.bounds, np.tile(self.deviations, (len(response.names), 1))])

    def surface(self, response: Response) -> ResponseSurface:
        """Simulate the response once on a grid, and interpolate it.

        Args:
            response: response of n parameters.
        """
        n = len(response.names)
        return ResponseSurface.of(response, tuple(self.nodes) * n if len(self.nodes) == 1 else self.nodes)

    def propagations(self, surface: ResponseSurface) -> dict[str, Propagation]:
        """Return the methods of propagation by name, all of them on the same surface.

        Args:
            surface: interpolated response.
        """
        families = self.families(surface)
        chaos = Chaos(families, self.degree, self.order)
        return {
            GAUSSIAN: ChaosGaussian(surface, chaos),
            MAXIMUM_ENTROPY: ChaosMaximumEntropy(surface, chaos, self.moments),
            PUSH_FORWARD: ExactPushForward(surface, families),
        }


def pairs(flat: Sequence[float] | Array) -> Array:
    """Arrange flat distribution parameters (2 n,) by uncertain parameter (n, 2)."""
    return np.asarray(flat, np.float64).reshape(2, -1).T.copy()
