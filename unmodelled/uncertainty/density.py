"""What every density of an output offers; L outputs stand side by side on the last axis."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray

from unmodelled.base.errors import BadInput

Array = NDArray[np.float64]

#: Standard deviations on either side of the mean that stand for the whole line: 1e-15 of a Gaussian's mass
#: lies beyond, and no density that has a Gaussian's tails feels the cut.
REACH = 8.0


class Density(ABC):
    """L univariate probability densities, each in the unit of its output."""

    @abstractmethod
    def log_density(self, y: Array) -> Array:
        """Natural logarithm of the densities at `y` (..., L), of the same shape; -inf where they are zero."""

    @abstractmethod
    def cumulative(self, y: Array) -> Array:
        """Probabilities of values up to `y` (..., L), of the same shape."""

    @abstractmethod
    def window(self) -> Array:
        """(L, 2) lower and upper ends of where practically all mass lies."""

    def density(self, y: Array) -> Array:
        """Densities at `y` (..., L), of the same shape, in one over the unit of y."""
        return np.asarray(np.exp(self.log_density(y)))


def check_spread(mean: Array, std: Array) -> None:
    """Refuse outputs that are not random.

    Args:
        mean, std: (L,).

    Raises:
        BadInput: a mean is not finite, or a standard deviation is not positive and finite; names the output.
    """
    bad = ~(np.isfinite(mean) & np.isfinite(std) & (std > 0.0))
    if bad.any():
        l = int(np.argmax(bad))
        found = f"mean {mean[l]:.6g}, standard deviation {std[l]:.6g}"
        raise BadInput(f"output {l + 1} of {mean.size} has no density: {found}")
