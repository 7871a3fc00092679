"""Gamma distribution: generalised Laguerre chaos."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np
from scipy.special import gammainc, gammaincinv

from unmodelled.base.arrays import Array
from unmodelled.uncertainty.families.family import Family
from unmodelled.uncertainty.families.orthogonal import Germ, Laguerre


@final
@dataclass(frozen=True)
class Gamma(Family):
    """Gamma distribution, theta = scale phi, phi standard gamma; mean shape scale, variance shape scale^2."""

    names: ClassVar[tuple[str, str]] = ("shape", "scale")
    positive: ClassVar[tuple[str, ...]] = names

    def support(self, alpha: Array) -> tuple[float, float]:
        return 0.0, np.inf

    def density(self, theta: Array, alpha: Array) -> Array:
        shape, scale = alpha
        phi = np.asarray(theta) / scale
        inside = phi >= 0.0
        return np.asarray(np.where(inside, Laguerre(shape).density(np.where(inside, phi, 1.0)), 0.0) / scale)

    def cumulative(self, theta: Array, alpha: Array) -> Array:
        shape, scale = alpha
        return np.asarray(gammainc(shape, np.maximum(theta, 0.0) / scale))

    def quantile(self, probability: Array, alpha: Array) -> Array:
        shape, scale = alpha
        return np.asarray(scale * gammaincinv(shape, probability))

    def germ(self, alpha: Array) -> Germ:
        return Laguerre(float(alpha[0]))

    def to_theta(self, phi: Array, alpha: Array) -> Array:
        return np.asarray(alpha[1] * phi)
