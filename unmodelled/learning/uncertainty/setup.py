"""What is chosen before an inverse uncertainty identification: a file of conf/uncertainty/."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

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

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Setup:
    """The structure of the uncertainty and how it is propagated.

    Attributes:
        family: of every parameter, made from the ends of its bounds.
        deviations: bounds of the second number of the family, in units of the nominal parameter; those of
            the first are the bounds of the parameter.
        degree, order, moments: d, q and m of polynomial chaos (section 3.2.7).
        nodes: of the response surface, along every parameter; one number for all of them is enough.
        tail: see `tail_floor`.
        search: of the global optimiser.
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
        """One for every parameter of `response`."""
        return tuple(self.family(float(low), float(high)) for low, high in response.bounds)

    def names(self, response: Response) -> tuple[str, ...]:
        """The 2 n numbers that are identified, in the order of the text: mu_1, ..., sigma_1, ..."""
        families = self.families(response)
        return tuple(f"{family.names[k]}_{i}" for k in range(2) for i, family in enumerate(families, start=1))

    def bounds(self, response: Response) -> Array:
        """(2 n, 2) of these numbers."""
        return np.concatenate([response.bounds, np.tile(self.deviations, (len(response.names), 1))])

    def surface(self, response: Response) -> ResponseSurface:
        """The response, simulated once on a grid."""
        n = len(response.names)
        return ResponseSurface.of(response, tuple(self.nodes) * n if len(self.nodes) == 1 else self.nodes)

    def propagations(self, surface: ResponseSurface) -> dict[str, Propagation]:
        """The methods that are compared, by name; all of them look at the surface."""
        families = self.families(surface)
        chaos = Chaos(families, self.degree, self.order)
        return {
            GAUSSIAN: ChaosGaussian(surface, chaos),
            MAXIMUM_ENTROPY: ChaosMaximumEntropy(surface, chaos, self.moments),
            PUSH_FORWARD: ExactPushForward(surface, families),
        }


def pairs(flat: Sequence[float] | Array) -> Array:
    """(n, 2) numbers of every parameter's family, from the flat order of the text."""
    return np.asarray(flat, np.float64).reshape(2, -1).T.copy()
