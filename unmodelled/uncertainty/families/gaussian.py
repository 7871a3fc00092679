"""Normal distribution: Hermite chaos."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np
from scipy.special import ndtr, ndtri

from unmodelled.base.arrays import Array
from unmodelled.uncertainty.families.family import Family
from unmodelled.uncertainty.families.orthogonal import Germ, Hermite


@final
@dataclass(frozen=True)
class Gaussian(Family):
    """Normal distribution, theta = mu + sigma phi with a standard normal phi."""

    names: ClassVar[tuple[str, str]] = ("mu", "sigma")
    positive: ClassVar[tuple[str, ...]] = ("sigma",)

    def support(self, alpha: Array) -> tuple[float, float]:
        return -np.inf, np.inf

    def density(self, theta: Array, alpha: Array) -> Array:
        mu, sigma = alpha
        return np.asarray(Hermite().density((theta - mu) / sigma) / sigma)

    def cumulative(self, theta: Array, alpha: Array) -> Array:
        mu, sigma = alpha
        return np.asarray(ndtr((theta - mu) / sigma))

    def quantile(self, probability: Array, alpha: Array) -> Array:
        return self.to_theta(ndtri(probability), alpha)

    def germ(self, alpha: Array) -> Germ:
        return Hermite()

    def to_theta(self, phi: Array, alpha: Array) -> Array:
        mu, sigma = alpha
        return np.asarray(mu + sigma * phi)
