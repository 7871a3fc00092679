"""The density of largest entropy with given moments (appendix 3.6)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import log, pi

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from unmodelled.base.errors import BadInput
from unmodelled.uncertainty import exponential
from unmodelled.uncertainty.density import Array, Density, check_spread
from unmodelled.uncertainty.dual import maximise_entropy
from unmodelled.uncertainty.gaussian import Gaussian

#: Difference of the first two standardised moments from 0 and 1 that rounding explains.
ROUNDING = 1e-6


@dataclass(frozen=True, eq=False)
class MaximumEntropy(Density):
    """exp(sum c_k z^k) on an interval of z = (y - mean) / std, eq. 3.15 with c = -lambda; zero beyond.

    Attributes:
        mean, std: (L,) in the unit of the outputs.
        coefficients: (K + 1, L) c, of the density of z; with the integral equal to 1.
        support: (L, 2) ends of the interval, in the unit of the outputs.
        fallback: (L,) True where no density was found that has these moments: there it is the Gaussian of the
            same mean and standard deviation, cut off at the ends of the interval.
        iterations: (L,) Newton steps of the fit, also of one that failed.
    """

    mean: Array
    std: Array
    coefficients: Array
    support: Array
    fallback: NDArray[np.bool_]
    iterations: NDArray[np.int64]

    @classmethod
    def fit(cls, mean: Array, std: Array, moments: Array, support: Array | None = None) -> MaximumEntropy:
        """The densities of largest entropy with the given moments (eq. 3.13).

        Args:
            mean, std: (L,) in the unit of the outputs.
            moments: (K, L) standardised, E[((Y - mean) / std)^k] for k = 1 ... K, K at least 2.
            support: (L, 2) ends of where each output can lie, in its unit, infinite where unknown. What lies
                further than `REACH` standard deviations from the mean is left out.

        Raises:
            BadInput: too few moments, moments that are not finite, an output that is not random, a mean that
                is not inside its support; names the output.
            ValueError: moments that are not standardised, arrays whose shapes do not agree.
        """
        mean, std, moments = (np.asarray(a, np.float64) for a in (mean, std, moments))
        _check_moments(mean, std, moments)
        limits = Gaussian(mean, std).window()
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
        """See `Density`."""
        low, high = self.support.T
        z = (np.clip(y, low, high) - self.mean) / self.std
        value = np.zeros_like(z)
        for c in self.coefficients[::-1]:
            value = value * z + c
        return np.where((y < low) | (y > high), -np.inf, value - np.log(self.std))

    def cumulative(self, y: Array) -> Array:
        """See `Density`: by Gauss-Legendre quadrature in panels, to about 1e-10."""
        z = (y - self.mean) / self.std
        points = exponential.integral(*self._standardised, self._sums, z.reshape(-1, self.mean.size))
        return np.asarray(points.reshape(z.shape))

    def window(self) -> Array:
        """See `Density`: the interval where it is not zero."""
        return self.support

    @cached_property
    def _standardised(self) -> tuple[Array, Array]:
        ends = (self.support - self.mean[:, None]) / self.std[:, None]
        return np.ascontiguousarray(self.coefficients.T), ends

    @cached_property
    def _sums(self) -> Array:
        return exponential.table(*self._standardised)


def _check_moments(mean: Array, std: Array, moments: Array) -> None:
    if len(moments) < 2:
        raise BadInput(f"too few moments: {len(moments)}, a density needs at least 2")
    if std.shape != mean.shape or moments.shape[1:] != mean.shape:
        raise ValueError(f"mean {mean.shape}, std {std.shape} and moments {moments.shape} do not agree")
    check_spread(mean, std)
    finite = np.isfinite(moments)
    if not finite.all():
        k, l = np.argwhere(~finite)[0]
        raise BadInput(f"moment {k + 1} of output {l + 1} of {mean.size} is {moments[k, l]}")
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
