"""The normal distribution on an interval with the polynomials of its own density."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from unmodelled.uncertainty.families.bounded_normal import BoundedNormal
from unmodelled.uncertainty.orthogonal import Germ, TruncatedHermite

Array = NDArray[np.float64]


@final
@dataclass(frozen=True)
class TruncatedNormal(BoundedNormal):
    """theta = mode + sigma phi: the germ is the truncated density itself, which changes with alpha.

    The "new polynomial basis" of section 3.2.4.
    """

    def germ(self, alpha: Array) -> Germ:
        mu, sigma = map(float, alpha)
        mode = self._mode(alpha)
        return TruncatedHermite((mode - mu) / sigma, (self.low - mode) / sigma, (self.high - mode) / sigma)

    def to_theta(self, phi: Array, alpha: Array) -> Array:
        return np.asarray(np.clip(self._mode(alpha) + alpha[1] * phi, self.low, self.high))

    def _mode(self, alpha: Array) -> float:
        return min(max(float(alpha[0]), self.low), self.high)
