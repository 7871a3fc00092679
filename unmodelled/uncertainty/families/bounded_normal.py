"""Normal distribution on an interval, for any germ."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.special import log_ndtr, ndtri_exp

from unmodelled.base.arrays import Array
from unmodelled.uncertainty.families.family import Family, check_interval


@dataclass(frozen=True)
class BoundedNormal(Family):
    """Normal density of mu and sigma, zero outside [low, high] and scaled to integral 1.

    mu and sigma are those of the whole normal; mu can lie outside the interval. Probabilities are kept as
    logarithms of the nearer tail, so that accuracy is kept where the whole normal has practically no mass.
    """

    low: float
    high: float
    names: ClassVar[tuple[str, str]] = ("mu", "sigma")
    positive: ClassVar[tuple[str, ...]] = ("sigma",)

    def __post_init__(self) -> None:
        check_interval(self.low, self.high)

    def support(self, alpha: Array) -> tuple[float, float]:
        return self.low, self.high

    def density(self, theta: Array, alpha: Array) -> Array:
        mu, sigma = alpha
        x, (a, b) = (theta - mu) / sigma, self._ends(alpha)
        if a > 0.0:
            a, b = -b, -a
        top = log_ndtr(b)
        mass = -np.expm1(log_ndtr(a) - top)
        inside = (theta >= self.low) & (theta <= self.high)
        peak = 1.0 / (mass * sigma * np.sqrt(2.0 * np.pi))
        return np.asarray(np.where(inside, np.exp(-0.5 * x**2 - top), 0.0) * peak)

    def cumulative(self, theta: Array, alpha: Array) -> Array:
        mu, sigma = alpha
        x, (a, b) = (np.clip(theta, self.low, self.high) - mu) / sigma, self._ends(alpha)
        if a > 0.0:
            top = log_ndtr(-a)
            return np.asarray(np.expm1(log_ndtr(-x) - top) / np.expm1(log_ndtr(-b) - top))
        bottom, log, top = log_ndtr(a), log_ndtr(x), log_ndtr(b)
        return np.asarray(np.exp(log - top) * np.expm1(bottom - log) / np.expm1(bottom - top))

    def quantile(self, probability: Array, alpha: Array) -> Array:
        with np.errstate(divide="ignore"):  # log 0 is what is meant at the ends
            return self._inverse(np.log(probability), np.log1p(-np.asarray(probability)), alpha)

    def _inverse(self, log_below: Array, log_above: Array, alpha: Array) -> Array:
        """Return theta from the logarithms of the probabilities below and above it (last two lines of eq.
        3.12).

        U = F(a) + p (F(b) - F(a)) = (1 - p) F(a) + p F(b) contains no differences, and neither does 1 - U.
        The smaller of the two is inverted.
        """
        mu, sigma = alpha
        a, b = self._ends(alpha)
        log_u = np.logaddexp(log_above + log_ndtr(a), log_below + log_ndtr(b))
        log_v = np.logaddexp(log_above + log_ndtr(-a), log_below + log_ndtr(-b))
        x = np.where(log_u < log_v, 1.0, -1.0) * ndtri_exp(np.minimum(log_u, log_v))
        return np.asarray(np.clip(mu + sigma * x, self.low, self.high))

    def _ends(self, alpha: Array) -> tuple[float, float]:
        mu, sigma = alpha
        return (self.low - mu) / sigma, (self.high - mu) / sigma
