"""Beta distribution on an interval: Jacobi chaos."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np
from scipy.special import betainc, betaincinv

from unmodelled.base.arrays import Array
from unmodelled.uncertainty.families.family import Family, check_interval
from unmodelled.uncertainty.families.orthogonal import Germ, Jacobi


@final
@dataclass(frozen=True)
class Beta(Family):
    """Beta distribution: density in proportion to (theta - low)^(a - 1) (high - theta)^(b - 1)."""

    low: float
    high: float
    names: ClassVar[tuple[str, str]] = ("a", "b")
    positive: ClassVar[tuple[str, ...]] = names

    def __post_init__(self) -> None:
        check_interval(self.low, self.high)

    def support(self, alpha: Array) -> tuple[float, float]:
        return self.low, self.high

    def density(self, theta: Array, alpha: Array) -> Array:
        phi = 2.0 * self._share(theta) - 1.0
        inside = np.abs(phi) <= 1.0
        density = self.germ(alpha).density(np.where(inside, phi, 0.0))
        return np.where(inside, density, 0.0) * 2.0 / (self.high - self.low)

    def cumulative(self, theta: Array, alpha: Array) -> Array:
        return np.asarray(betainc(*alpha, np.clip(self._share(theta), 0.0, 1.0)))

    def quantile(self, probability: Array, alpha: Array) -> Array:
        return np.asarray(self.low + (self.high - self.low) * betaincinv(*alpha, probability))

    def germ(self, alpha: Array) -> Germ:
        return Jacobi(*map(float, alpha))

    def to_theta(self, phi: Array, alpha: Array) -> Array:
        return np.asarray(0.5 * (self.low + self.high) + 0.5 * (self.high - self.low) * phi)

    def _share(self, theta: Array) -> Array:
        return np.asarray((theta - self.low) / (self.high - self.low))
