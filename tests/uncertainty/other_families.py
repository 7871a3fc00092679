"""Families of table 3.1 that the library does not need, as others would add them, and their germs."""

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np
from scipy.special import (
    betainc,
    betaincinv,
    betaln,
    gammainc,
    gammaincinv,
    gammaln,
    ndtr,
    ndtri,
    xlog1py,
    xlogy,
)

from unmodelled.base.arrays import Array
from unmodelled.uncertainty.families import Family
from unmodelled.uncertainty.families.family import check_interval
from unmodelled.uncertainty.families.orthogonal import Germ, Hermite


@final
@dataclass(frozen=True)
class Laguerre(Germ):
    """Standard gamma variable on [0, inf) with the generalised Laguerre polynomials."""

    shape: float  # positive

    @property
    def support(self) -> tuple[float, float]:
        return 0.0, np.inf

    def density(self, phi: Array) -> Array:
        return np.asarray(np.exp(xlogy(self.shape - 1.0, phi) - phi - gammaln(self.shape)))

    def recurrence(self, count: int) -> tuple[Array, Array]:
        k = np.arange(1.0, count + 1)
        return 2.0 * (k - 1.0) + self.shape, np.sqrt(k * (k - 1.0 + self.shape))


@final
@dataclass(frozen=True)
class Jacobi(Germ):
    """Beta variable on [-1, 1] with the Jacobi polynomials (the Legendre polynomials for a = b = 1)."""

    a: float  # positive
    b: float  # positive

    @property
    def support(self) -> tuple[float, float]:
        return -1.0, 1.0

    def density(self, phi: Array) -> Array:
        a, b = self.a, self.b
        log = xlog1py(a - 1.0, phi) + xlog1py(b - 1.0, -phi) - betaln(a, b) - (a + b - 1.0) * np.log(2.0)
        return np.asarray(np.exp(log))

    def recurrence(self, count: int) -> tuple[Array, Array]:
        a, b, k = self.a, self.b, np.arange(1.0, count + 1)
        s = a + b - 2.0 + 2.0 * k  # of b_k; that of a_k is s + 2
        diagonal = np.empty(count)
        diagonal[:1] = (a - b) / (a + b)
        diagonal[1:] = (a - b) * (a + b - 2.0) / (s * (s + 2.0))[:-1]
        squares = 4.0 * k * (k + a - 1.0) * (k + b - 1.0)
        # at k = 1 the factor (k + a + b - 2) cancels against (s - 1), also where both are zero
        squares[1:] *= (k + a + b - 2.0)[1:] / (s - 1.0)[1:]
        return diagonal, np.sqrt(squares / (s**2 * (s + 1.0)))


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
