"""Section 3.2.8: y = tan(theta / 8) + exp(theta / 6 - 1) + tanh(theta / 2), N(0, 2) clipped to [-2, 5].

The text draws the numbers in figure 3.4. Its reading: eta of eq. (3.12) of a standard normal phi, orthonormal
Hermite polynomials of phi, moments of Y under the density of theta.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad
from scipy.special import ndtri, roots_legendre
from scipy.stats import truncnorm

from pipeline.uncertainty.references import earth_mover_distance
from unmodelled.base.arrays import Array
from unmodelled.uncertainty.chaos import Chaos, Expansion
from unmodelled.uncertainty.density import Density, GaussianDensity
from unmodelled.uncertainty.families import ClippedNormal, TruncatedNormal
from unmodelled.uncertainty.families.orthogonal import Hermite
from unmodelled.uncertainty.maximum_entropy import MaximumEntropy

CLIPPED = ClippedNormal(-2.0, 5.0)
ALPHA = np.array([[0.0, 2.0]])
#: Raw moments of Y.
MOMENTS = [0.647864, 1.127099, 1.719595, 3.114331]
COEFFICIENTS = [0.64786, 0.82640, 0.04191, -0.14057, 0.00114, 0.04613]


def response(theta: Array) -> Array:
    return np.asarray(np.tan(theta / 8.0) + np.exp(theta / 6.0 - 1.0) + np.tanh(theta / 2.0))


def expand(degree: int, order: int) -> Expansion:
    chaos = Chaos((CLIPPED,), degree, order)
    return chaos.expand(ALPHA, response(chaos.nodes(ALPHA)))


def test_true_coefficients() -> None:
    assert_allclose(expand(5, 100).coefficients[:, 0], COEFFICIENTS, atol=1e-5)


def test_true_coefficients_by_adaptive_integration() -> None:
    hermite = Hermite()

    def integrand(phi: float, k: int) -> float:
        point = np.array(phi)
        weight = hermite.polynomials(point, k)[k] * hermite.density(point)
        return float(response(CLIPPED.to_theta(point, ALPHA[0])) * weight)

    for k, expected in enumerate(COEFFICIENTS):
        found = sum(quad(integrand, a, a + 4.0, args=(k,), epsabs=1e-10)[0] for a in range(-12, 12, 4))
        assert found == pytest.approx(expected, abs=1e-5)


def test_coefficients_by_a_rule_in_theta_converge_slowly() -> None:
    """400 Gauss-Legendre points in theta leave the fifth coefficient 1.4e-4 away from its limit.

    In theta the polynomials are those of a normal quantile, which has no bound at the ends of the interval.
    """
    points, weights = roots_legendre(400)
    theta = 1.5 + 3.5 * points
    phi = ndtri(CLIPPED.cumulative(theta, ALPHA[0]))
    share = 3.5 * weights * CLIPPED.density(theta, ALPHA[0])
    found = Hermite().polynomials(phi, 5) @ (share * response(theta))
    assert_allclose(found, [0.64786, 0.82640, 0.04191, -0.14059, 0.00117, 0.04599], atol=1e-5)


def test_coefficients_of_degree_4_by_5_points() -> None:
    expected = [0.64924, 0.81633, 0.03566, -0.11827, 0.01013]
    assert_allclose(expand(4, 5).coefficients[:, 0], expected, atol=1e-5)


def test_true_moments() -> None:
    """Of Y itself, as every chaos of high degree finds them."""
    chaos = Chaos((TruncatedNormal(-2.0, 5.0),), 30, 40)
    assert_allclose(chaos.expand(ALPHA, response(chaos.nodes(ALPHA))).moments(4)[:, 0], MOMENTS, atol=1e-5)
    density = [
        quad(lambda x, m=m: response(np.array(x)) ** m * CLIPPED.density(np.array(x), ALPHA[0]), -2.0, 5.0)[0]
        for m in range(1, 5)
    ]
    assert_allclose(density, MOMENTS, atol=5e-7)


THETA = truncnorm(-1.0, 2.5, 0.0, 2.0)
GRID = np.linspace(-2.0, 5.0, 20_001)
NODES, WEIGHTS = roots_legendre(400)
POINTS, MASSES = 1.5 + 3.5 * NODES, 3.5 * WEIGHTS * THETA.pdf(1.5 + 3.5 * NODES)


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


def test_exact_density() -> None:
    y, w = 0.9 + 1.654 * NODES, 1.654 * WEIGHTS
    f = Exact().density(y)
    f_moments = [(w * f) @ y**k for k in range(5)]
    assert_allclose(f_moments, [1.0, *MOMENTS], rtol=2e-3)


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
    fits = [MaximumEntropy.fit(mean, std, moments[:k], Exact().window()) for k in (2, 3, 4)]
    distances = [earth_mover_distance(fit, Exact())[0] for fit in fits]
    assert distances == sorted(distances, reverse=True)
