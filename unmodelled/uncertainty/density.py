"""Densities of L outputs (last axis), and Gaussian densities."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from math import log, pi

import numpy as np
from scipy.special import ndtr

from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput

#: Standard deviations on either side of the mean that stand for the whole line: 1e-15 of a Gaussian's mass
#: lies beyond, and no density that has a Gaussian's tails feels the cut.
REACH = 8.0


class Density(ABC):
    """Probability densities of L outputs, each in one over the unit of its output."""

    @abstractmethod
    def log_density(self, y: Array) -> Array:
        """Return the natural logarithm of the densities.

        Args:
            y: values of the outputs, shape (..., L).

        Returns:
            Log-densities of shape (..., L); -inf where a density is zero.
        """

    @abstractmethod
    def cumulative(self, y: Array) -> Array:
        """Return the cumulative probabilities.

        Args:
            y: values of the outputs, shape (..., L).

        Returns:
            Probabilities of at most y, shape (..., L).
        """

    @abstractmethod
    def window(self) -> Array:
        """Return intervals that contain practically all probability.

        Returns:
            Lower and upper ends, shape (L, 2), in the unit of the outputs.
        """

    def density(self, y: Array) -> Array:
        """Return the densities.

        Args:
            y: values of the outputs, shape (..., L).

        Returns:
            Densities of shape (..., L), in one over the unit of the outputs.
        """
        return np.asarray(np.exp(self.log_density(y)))


def check_spread(mean: Array, std: Array) -> None:
    """Refuse outputs without spread, by their means (L,) and standard deviations (L,)."""
    bad = ~(np.isfinite(mean) & np.isfinite(std) & (std > 0.0))
    if bad.any():
        l = int(np.argmax(bad))
        found = f"mean {mean[l]:.6g}, standard deviation {std[l]:.6g}"
        raise BadInput(
            f"output {l + 1} of {mean.size} has no density: {found}: it must vary with the "
            "parameters, widen their distribution"
        )


@dataclass(frozen=True, eq=False)
class GaussianDensity(Density):
    """Gaussian densities: of largest entropy on the whole line for a given mean and variance."""

    mean: Array  # (L,)
    std: Array  # (L,), positive

    def __post_init__(self) -> None:
        check_spread(self.mean, self.std)

    def log_density(self, y: Array) -> Array:
        z = (y - self.mean) / self.std
        return np.asarray(-0.5 * z * z - np.log(self.std) - 0.5 * log(2.0 * pi))

    def cumulative(self, y: Array) -> Array:
        return np.asarray(ndtr((y - self.mean) / self.std))

    def window(self) -> Array:
        return np.stack([self.mean - REACH * self.std, self.mean + REACH * self.std], -1)
