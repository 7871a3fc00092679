"""What every family of distributions of an uncertain parameter answers."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from unmodelled.base.errors import BadInput
from unmodelled.uncertainty.orthogonal import Germ

Array = NDArray[np.float64]


class Family(ABC):
    """Distributions of one parameter theta that two numbers alpha tell apart.

    A family is a standard variable phi, its germ, and the transformation theta = eta(phi; alpha) (section
    3.2.4). Everywhere alpha has shape (2,) and is one that `check` accepts; theta, phi and probabilities may
    have any shape, which is the shape of the answer.
    """

    names: ClassVar[tuple[str, str]]
    #: Of the names, those of positive numbers.
    positive: ClassVar[tuple[str, ...]] = ()

    def check(self, alpha: Array) -> None:
        """Raises BadInput where no member of the family has these two numbers."""
        if np.shape(alpha) != (2,):
            raise BadInput(
                f"expected the two numbers {' and '.join(self.names)}, got shape {np.shape(alpha)}"
            )
        for name, value in zip(self.names, alpha, strict=True):
            if not math.isfinite(value):
                raise BadInput(f"{name} must be finite, got {value:g}")
            if name in self.positive and not value > 0.0:
                raise BadInput(f"{name} must be positive, got {value:g}")

    @abstractmethod
    def support(self, alpha: Array) -> tuple[float, float]:
        """Smallest and largest theta, infinite where there is none."""

    @abstractmethod
    def density(self, theta: Array, alpha: Array) -> Array:
        """Zero outside the support."""

    @abstractmethod
    def cumulative(self, theta: Array, alpha: Array) -> Array:
        """Probability of at most theta."""

    @abstractmethod
    def quantile(self, probability: Array, alpha: Array) -> Array:
        """The theta whose cumulative probability is this one."""

    @abstractmethod
    def germ(self, alpha: Array) -> Germ:
        """The standard variable phi with its orthonormal polynomials."""

    @abstractmethod
    def to_theta(self, phi: Array, alpha: Array) -> Array:
        """eta(phi; alpha)."""


def check_interval(low: float, high: float) -> None:
    """Raises BadInput unless both are finite and low < high."""
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise BadInput(f"low must be less than high and both finite, got {low:g} and {high:g}")
