"""Normal distribution on an interval, with the orthonormal polynomials of its own density."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.uncertainty.families.bounded_normal import BoundedNormal
from unmodelled.uncertainty.families.orthogonal import Germ, TruncatedHermite


@final
@dataclass(frozen=True)
class TruncatedNormal(BoundedNormal):
    """Normal distribution on an interval, theta = mode + sigma phi, with the truncated density itself as
    germ.

    This is the "new polynomial basis" of section 3.2.4; it changes with alpha.

    Examples:
        >>> TruncatedNormal(0.0, 2.0).quantile(np.array([0.5]), np.array([1.0, 0.4])).tolist()
        [1.0]
    """

    def germ(self, alpha: Array) -> Germ:
        mu, sigma = map(float, alpha)
        mode = self._mode(alpha)
        return TruncatedHermite((mode - mu) / sigma, (self.low - mode) / sigma, (self.high - mode) / sigma)

    def to_theta(self, phi: Array, alpha: Array) -> Array:
        return np.asarray(np.clip(self._mode(alpha) + alpha[1] * phi, self.low, self.high))

    def _mode(self, alpha: Array) -> float:
        return min(max(float(alpha[0]), self.low), self.high)
