"""Section 3.2.8: y = tan(theta / 8) + exp(theta / 6 - 1) + tanh(theta / 2), N(0, 2) clipped to [-2, 5].

The text draws the numbers in figure 3.4. Its reading: eta of eq. (3.12) of a standard normal phi, orthonormal
Hermite polynomials of phi, moments of Y under the density of theta.
"""

from __future__ import annotations

import numpy as np
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.special import ndtri, roots_legendre

from unmodelled.uncertainty.chaos import Chaos, Expansion
from unmodelled.uncertainty.families import ClippedNormal, TruncatedNormal
from unmodelled.uncertainty.families.orthogonal import Hermite

Array = NDArray[np.float64]

CLIPPED = ClippedNormal(-2.0, 5.0)
ALPHA = np.array([[0.0, 2.0]])
COEFFICIENTS = [0.64786, 0.82640, 0.04191, -0.14057, 0.00114, 0.04613]


def y(theta: Array) -> Array:
    return np.asarray(np.tan(theta / 8.0) + np.exp(theta / 6.0 - 1.0) + np.tanh(theta / 2.0))


def expand(degree: int, order: int) -> Expansion:
    chaos = Chaos((CLIPPED,), degree, order)
    return chaos.expand(ALPHA, y(chaos.nodes(ALPHA)))


def test_true_coefficients() -> None:
    assert_allclose(expand(5, 100).coefficients[:, 0], COEFFICIENTS, atol=1e-5)


def test_true_coefficients_by_adaptive_integration() -> None:
    hermite = Hermite()

    def integrand(phi: float, k: int) -> float:
        point = np.array(phi)
        return float(
            y(CLIPPED.to_theta(point, ALPHA[0])) * hermite.polynomials(point, k)[k] * hermite.density(point)
        )

    found = [
        sum(quad(integrand, a, a + 4.0, args=(k,), epsabs=1e-10)[0] for a in range(-12, 12, 4))
        for k in range(6)
    ]
    assert_allclose(found, COEFFICIENTS, atol=1e-5)


def test_coefficients_by_a_rule_in_theta_converge_slowly() -> None:
    """400 Gauss-Legendre points in theta leave the fifth coefficient 1.4e-4 away from its limit.

    In theta the polynomials are those of a normal quantile, which has no bound at the ends of the interval.
    """
    points, weights = roots_legendre(400)
    theta = 1.5 + 3.5 * points
    phi = ndtri(CLIPPED.cumulative(theta, ALPHA[0]))
    share = 3.5 * weights * CLIPPED.density(theta, ALPHA[0])
    found = Hermite().polynomials(phi, 5) @ (share * y(theta))
    assert_allclose(found, [0.64786, 0.82640, 0.04191, -0.14059, 0.00117, 0.04599], atol=1e-5)


def test_coefficients_of_degree_4_by_5_points() -> None:
    assert_allclose(
        expand(4, 5).coefficients[:, 0], [0.64924, 0.81633, 0.03566, -0.11827, 0.01013], atol=1e-5
    )


def test_true_moments() -> None:
    """Of Y itself, as every chaos of high degree finds them."""
    exact = [0.647864, 1.127099, 1.719595, 3.114331]
    chaos = Chaos((TruncatedNormal(-2.0, 5.0),), 30, 40)
    assert_allclose(chaos.expand(ALPHA, y(chaos.nodes(ALPHA))).moments(4)[:, 0], exact, atol=1e-5)
    density = [
        quad(lambda x, m=m: y(np.array(x)) ** m * CLIPPED.density(np.array(x), ALPHA[0]), -2.0, 5.0)[0]
        for m in range(1, 5)
    ]
    assert_allclose(density, exact, atol=1e-5)


def test_the_variance_leaves_out_the_mean() -> None:
    """The sum printed below eq. (3.9) for the variance has c_1^2 too: the second raw moment."""
    ours = expand(4, 5)
    assert_allclose(ours.variance, np.sum(ours.coefficients[1:] ** 2, axis=0))
    assert_allclose(np.sum(ours.coefficients**2, axis=0), ours.moments(2)[1])
    assert_allclose(ours.variance, 1.127099 - 0.647864**2, rtol=0.05)
