"""Uniform distribution between two unknown ends: Legendre chaos."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.uncertainty.families.family import Family, check_interval
from unmodelled.uncertainty.families.orthogonal import Germ, Jacobi


@final
@dataclass(frozen=True)
class Uniform(Family):
    """Uniform distribution from low to high, with a phi that is uniform on [-1, 1]."""

    names: ClassVar[tuple[str, str]] = ("low", "high")

    def check(self, alpha: Array) -> None:
        super().check(alpha)
        check_interval(*alpha)

    def support(self, alpha: Array) -> tuple[float, float]:
        low, high = alpha
        return float(low), float(high)

    def density(self, theta: Array, alpha: Array) -> Array:
        low, high = alpha
        return np.where((theta >= low) & (theta <= high), 1.0 / (high - low), 0.0)

    def cumulative(self, theta: Array, alpha: Array) -> Array:
        low, high = alpha
        return np.asarray(np.clip((theta - low) / (high - low), 0.0, 1.0))

    def quantile(self, probability: Array, alpha: Array) -> Array:
        low, high = alpha
        return np.asarray(low + (high - low) * probability)

    def germ(self, alpha: Array) -> Germ:
        return Jacobi(1.0, 1.0)

    def to_theta(self, phi: Array, alpha: Array) -> Array:
        low, high = alpha
        return np.asarray(0.5 * (low + high) + 0.5 * (high - low) * phi)
