"""Densities of largest entropy with given moments (appendix 3.6)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import log, pi

import numpy as np
from scipy.special import ndtr

from unmodelled.base.arrays import Array, Indices, Mask
from unmodelled.base.errors import BadInput
from unmodelled.uncertainty import exponential
from unmodelled.uncertainty.density import Density, GaussianDensity, check_spread
from unmodelled.uncertainty.exponential import maximise_entropy

#: Difference of the first two standardised moments from 0 and 1 that rounding explains.
ROUNDING = 1e-6


@dataclass(frozen=True, eq=False)
class MaximumEntropy(Density):
    """Densities exp(sum c_k z^k) of z = (y - mean) / std on an interval, zero outside (eq. 3.15)."""

    mean: Array  # (L,)
    std: Array  # (L,)
    coefficients: Array  # (K + 1, L), of the density of z, with integral 1
    support: Array  # (L, 2), in the unit of the outputs
    #: (L,), whether no density with these moments was found; it is then the Gaussian of the same mean and
    #: standard deviation, truncated to the interval.
    fallback: Mask
    iterations: Indices  # (L,), Newton steps, also of fits that failed

    @classmethod
    def fit(cls, mean: Array, std: Array, moments: Array, support: Array | None = None) -> MaximumEntropy:
        """Compute the densities of largest entropy with standardised moments (K, L) (eq. 3.13)."""
        mean, std, moments = (np.asarray(a, np.float64) for a in (mean, std, moments))
        _check_moments(mean, std, moments)
        limits = GaussianDensity(mean, std).window()
        if support is not None:
            limits = _within(limits, mean, np.asarray(support, np.float64))
        ends = (limits - mean[:, None]) / std[:, None]
        powers = np.concatenate([np.ones((1, mean.size)), moments])
        coefficients, iterations, solved = maximise_entropy(np.ascontiguousarray(powers.T), ends)
        coefficients[~solved] = 0.0
        coefficients[~solved, 0] = -0.5 * log(2.0 * pi) - np.log(np.diff(ndtr(ends[~solved])))[:, 0]
        coefficients[~solved, 2] = -0.5
        return cls(mean, std, coefficients.T, limits, ~solved, iterations)

    def log_density(self, y: Array) -> Array:
        low, high = self.support.T
        z = (np.clip(y, low, high) - self.mean) / self.std
        value = np.zeros_like(z)
        for c in self.coefficients[::-1]:
            value = value * z + c
        return np.where((y < low) | (y > high), -np.inf, value - np.log(self.std))

    def cumulative(self, y: Array) -> Array:
        z = (y - self.mean) / self.std
        points = exponential.integral(*self._standardised, self._sums, z.reshape(-1, self.mean.size))
        return np.asarray(points.reshape(z.shape))

    def window(self) -> Array:
        return self.support

    @cached_property
    def _standardised(self) -> tuple[Array, Array]:
        ends = (self.support - self.mean[:, None]) / self.std[:, None]
        return np.ascontiguousarray(self.coefficients.T), ends

    @cached_property
    def _sums(self) -> Array:
        return exponential.panel_integrals(*self._standardised)


def _check_moments(mean: Array, std: Array, moments: Array) -> None:
    if len(moments) < 2:
        raise BadInput(f"moments must be at least 2, got {len(moments)}")
    if std.shape != mean.shape or moments.shape[1:] != mean.shape:
        raise ValueError(f"mean {mean.shape}, std {std.shape} and moments {moments.shape} do not agree")
    check_spread(mean, std)
    finite = np.isfinite(moments)
    if not finite.all():
        k, l = np.argwhere(~finite)[0]
        raise BadInput(
            f"moment {k + 1} of output {l + 1} of {mean.size} is {moments[k, l]}: narrow the bounds"
        )
    if np.abs(moments[:2] - np.array([[0.0], [1.0]])).max(initial=0.0) > ROUNDING:
        raise ValueError("moments are not standardised: the first must be 0 and the second 1")


def _within(window: Array, mean: Array, support: Array) -> Array:
    if support.shape != (mean.size, 2):
        raise ValueError(f"support has shape {support.shape}, expected {(mean.size, 2)}")
    outside = ~((support[:, 0] < mean) & (mean < support[:, 1]))
    if outside.any():
        l = int(np.argmax(outside))
        raise BadInput(
            f"output {l + 1} of {mean.size} has its mean {mean[l]:.6g} outside its support "
            f"[{support[l, 0]:.6g}, {support[l, 1]:.6g}]"
        )
    return np.clip(support, window[:, :1], window[:, 1:])
