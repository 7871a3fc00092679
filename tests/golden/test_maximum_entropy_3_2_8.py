"""Section 3.2.8: densities from the exact moments of the univariate example, against the exact density."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from scipy.special import roots_legendre
from scipy.stats import truncnorm

from unmodelled.uncertainty.density import Density, GaussianDensity, earth_mover_distance
from unmodelled.uncertainty.maximum_entropy import MaximumEntropy

Array = NDArray[np.float64]

THETA = truncnorm(-1.0, 2.5, 0.0, 2.0)
GRID = np.linspace(-2.0, 5.0, 20_001)
RAW = np.array([0.647864, 1.127099, 1.719595, 3.114331])
NODES, WEIGHTS = roots_legendre(400)
POINTS, MASSES = 1.5 + 3.5 * NODES, 3.5 * WEIGHTS * THETA.pdf(1.5 + 3.5 * NODES)


def response(theta: Array) -> Array:
    return np.asarray(np.tan(theta / 8.0) + np.exp(theta / 6.0 - 1.0) + np.tanh(theta / 2.0))


class Exact(Density):
    """Of Y by footnote 4: f(theta(y)) / |y'(theta(y))|."""

    def log_density(self, y: Array) -> Array:
        theta = np.interp(y, response(GRID), GRID)
        slope = 0.125 / np.cos(theta / 8.0) ** 2 + np.exp(theta / 6.0 - 1.0) / 6.0
        slope += 0.5 / np.cosh(theta / 2.0) ** 2
        inside = (y >= response(GRID)[0]) & (y <= response(GRID)[-1])
        return np.where(inside, THETA.logpdf(theta) - np.log(slope), -np.inf)

    def cumulative(self, y: Array) -> Array:
        return np.asarray(THETA.cdf(np.interp(y, response(GRID), GRID)))

    def window(self) -> Array:
        return response(GRID)[None, [0, -1]]


def standardised() -> tuple[Array, Array, Array]:
    y = response(POINTS)
    mean = MASSES @ y
    std = np.sqrt(MASSES @ (y - mean) ** 2)
    moments = np.array([MASSES @ ((y - mean) / std) ** k for k in range(1, 5)])
    return np.array([mean]), np.array([std]), moments[:, None]


def test_exact_moments() -> None:
    assert_allclose([MASSES @ response(POINTS) ** k for k in range(1, 5)], RAW, atol=5e-7)


def test_exact_density() -> None:
    y, w = 0.9 + 1.654 * NODES, 1.654 * WEIGHTS
    f = Exact().density(y)
    f_moments = [(w * f) @ y**k for k in range(5)]
    assert_allclose(f_moments, [1.0, *RAW], rtol=2e-3)


@pytest.mark.parametrize("support, most", [(None, 0.031), (Exact().window(), 0.003)])
def test_four_moments_beat_the_gaussian(support: Array | None, most: float) -> None:
    mean, std, moments = standardised()
    fit = MaximumEntropy.fit(mean, std, moments, support)
    assert not fit.fallback.any()
    distance = earth_mover_distance(fit, Exact())[0]
    assert distance <= most
    assert earth_mover_distance(GaussianDensity(mean, std), Exact())[0] > 3.0 * distance


def test_more_moments_come_closer() -> None:
    mean, std, moments = standardised()
    support = Exact().window()
    distances = [
        earth_mover_distance(MaximumEntropy.fit(mean, std, moments[:k], support), Exact())[0]
        for k in (2, 3, 4)
    ]
    assert distances == sorted(distances, reverse=True)
