"""Gaussian densities from a mean and a standard deviation."""

from __future__ import annotations

from dataclasses import dataclass
from math import log, pi

import numpy as np
from scipy.special import ndtr

from unmodelled.uncertainty.density import REACH, Array, Density, check_spread


@dataclass(frozen=True, eq=False)
class Gaussian(Density):
    """The density of largest entropy on the whole line for a given mean and variance.

    Attributes:
        mean, std: (L,) in the unit of the outputs.

    Raises:
        BadInput: a standard deviation is not positive, or a number is not finite.
    """

    mean: Array
    std: Array

    def __post_init__(self) -> None:
        check_spread(self.mean, self.std)

    def log_density(self, y: Array) -> Array:
        """See `Density`."""
        z = (y - self.mean) / self.std
        return np.asarray(-0.5 * z * z - np.log(self.std) - 0.5 * log(2.0 * pi))

    def cumulative(self, y: Array) -> Array:
        """See `Density`."""
        return np.asarray(ndtr((y - self.mean) / self.std))

    def window(self) -> Array:
        """See `Density`: the mean with `REACH` standard deviations on either side."""
        return np.stack([self.mean - REACH * self.std, self.mean + REACH * self.std], -1)
