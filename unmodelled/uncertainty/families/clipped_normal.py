"""Normal distribution clipped to an interval as in the text: Hermite chaos."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from scipy.special import log_ndtr

from unmodelled.base.arrays import Array
from unmodelled.uncertainty.families.bounded_normal import BoundedNormal
from unmodelled.uncertainty.families.orthogonal import Germ, Hermite


@final
@dataclass(frozen=True)
class ClippedNormal(BoundedNormal):
    """Normal distribution on an interval, theta = eta(phi; alpha) of eq. (3.12) with a standard normal phi.

    eta bends at the ends of the interval, so that polynomials in phi converge slowly even to theta itself.
    TruncatedNormal is the same distribution without the bend.

    Examples:
        >>> import numpy as np
        >>> ClippedNormal(0.0, 2.0).quantile(np.array([0.5]), np.array([1.0, 0.4])).tolist()
        [1.0]
    """

    def germ(self, alpha: Array) -> Germ:
        return Hermite()

    def to_theta(self, phi: Array, alpha: Array) -> Array:
        return self._inverse(log_ndtr(phi), log_ndtr(-phi), alpha)
