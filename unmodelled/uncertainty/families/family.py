"""Base class of all families of distributions of an uncertain parameter."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.uncertainty.families.orthogonal import Germ


class Family(ABC):
    """Distributions of one parameter theta with two distribution parameters alpha.

    A family consists of a standard variable phi (its germ) and a transformation theta = eta(phi; alpha)
    (section 3.2.4). alpha always has shape (2,) and is accepted by `check`.
    """

    names: ClassVar[tuple[str, str]]  # of the two distribution parameters
    positive: ClassVar[tuple[str, ...]] = ()  # names of those that must be positive

    def check(self, alpha: Array) -> None:
        """Refuse distribution parameters that the family does not have.

        Args:
            alpha: two distribution parameters, shape (2,).

        Raises:
            BadInput: if the shape is another, a number is not finite, or one that must be positive is not.
        """
        if np.shape(alpha) != (2,):
            raise BadInput(
                f"alpha must be the two numbers {' and '.join(self.names)}, got shape {np.shape(alpha)}"
            )
        for name, value in zip(self.names, alpha, strict=True):
            if not math.isfinite(value):
                raise BadInput(f"{name} must be finite, got {value:g}")
            if name in self.positive and not value > 0.0:
                raise BadInput(f"{name} must be positive, got {value:g}")

    @abstractmethod
    def support(self, alpha: Array) -> tuple[float, float]:
        """Return the smallest and largest theta, infinite on an unlimited side.

        Args:
            alpha: two distribution parameters, shape (2,).

        Returns:
            Lower and upper end.
        """

    @abstractmethod
    def density(self, theta: Array, alpha: Array) -> Array:
        """Return the probability density.

        Args:
            theta: values of the parameter, any shape.
            alpha: two distribution parameters, shape (2,).

        Returns:
            Densities, of the shape of theta; zero outside the support.
        """

    @abstractmethod
    def cumulative(self, theta: Array, alpha: Array) -> Array:
        """Return the cumulative probability.

        Args:
            theta: values of the parameter, any shape.
            alpha: two distribution parameters, shape (2,).

        Returns:
            Probabilities of at most theta, of the shape of theta.
        """

    @abstractmethod
    def quantile(self, probability: Array, alpha: Array) -> Array:
        """Return the quantiles: the inverse of `cumulative`.

        Args:
            probability: cumulative probabilities, any shape.
            alpha: two distribution parameters, shape (2,).

        Returns:
            Values of theta, of the shape of the probabilities.
        """

    @abstractmethod
    def germ(self, alpha: Array) -> Germ:
        """Return the standard variable phi with its orthonormal polynomials.

        Args:
            alpha: two distribution parameters, shape (2,).

        Returns:
            Standard variable.
        """

    @abstractmethod
    def to_theta(self, phi: Array, alpha: Array) -> Array:
        """Return theta = eta(phi; alpha).

        Args:
            phi: values of the standard variable, any shape.
            alpha: two distribution parameters, shape (2,).

        Returns:
            Values of theta, of the shape of phi.
        """


def check_interval(low: float, high: float) -> None:
    """Refuse an empty or infinite interval."""
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise BadInput(f"low must be less than high and both finite, got {low:g} and {high:g}")
