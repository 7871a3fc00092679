"""Polynomial chaos: coefficients, moments of any order, and what it refuses."""

from itertools import product
from math import comb

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from tests.uncertainty.other_families import Beta, Gamma, Gaussian, Uniform
from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.uncertainty.chaos import Chaos, Expansion, multi_indices
from unmodelled.uncertainty.families import ClippedNormal, Family, TruncatedNormal

Families, Alpha = tuple[Family, ...], list[list[float]]
CASES: list[tuple[Families, Alpha]] = [
    ((Gaussian(), Gaussian()), [[0.3, 0.2], [-0.1, 0.4]]),
    ((Gamma(), Beta(-1.0, 2.0)), [[2.5, 0.3], [2.0, 3.5]]),
    ((Uniform(), Gaussian(), Gamma()), [[-0.5, 0.8], [0.1, 0.2], [1.0, 0.2]]),
    ((TruncatedNormal(0.7, 1.3), TruncatedNormal(0.4, 1.15)), [[0.91, 0.081], [0.55, 0.046]]),
    ((ClippedNormal(0.7, 1.3), TruncatedNormal(0.4, 1.15)), [[0.91, 0.081], [0.3, 0.1]]),
]
cases = pytest.mark.parametrize(("families", "alpha"), CASES)


def response(theta: Array) -> Array:
    """(S, n) -> (S, 3) smooth outputs."""
    total = theta.sum(axis=1)
    return np.stack([np.exp(0.5 * total), np.tanh(theta[:, 0]) * theta[:, -1], 2.0 + np.sin(total)], axis=1)


def expansion(families: Families, alpha: Alpha, degree: int, order: int) -> Expansion:
    chaos = Chaos(families, degree, order)
    return chaos.expand(np.array(alpha), response(chaos.nodes(np.array(alpha))))


@given(st.integers(1, 4), st.integers(0, 5))
def test_basis_has_every_polynomial_once(n: int, degree: int) -> None:
    indices = multi_indices(n, degree)
    assert indices.shape == (comb(n + degree, n), n)
    assert len(np.unique(indices, axis=0)) == len(indices)
    total = indices.sum(axis=1)
    assert total[0] == 0
    assert np.all(np.diff(total) >= 0)
    assert total[-1] == degree


@pytest.mark.long
@cases
def test_polynomials_are_found_exactly(families: Families, alpha: Alpha) -> None:
    """A polynomial of the germs of degree 3 is its own expansion, everywhere."""
    chaos, two = Chaos(families, 3, 4), np.array(alpha)
    coefficients = np.random.default_rng(1).normal(size=(comb(3 + len(families), 3), 2))
    known = Expansion(tuple(f.germ(a) for f, a in zip(families, two, strict=True)), 3, coefficients)
    nodes = [germ.quadrature(4)[0] for germ in known.germs]
    phi = np.array(list(product(*nodes)))
    theta = [f.to_theta(p, a) for f, p, a in zip(families, phi.T, two, strict=True)]
    assert_allclose(chaos.nodes(two), np.transpose(theta), rtol=1e-14)
    found = chaos.expand(two, known(phi))
    assert_allclose(found.coefficients, known.coefficients, atol=1e-12)
    elsewhere = np.random.default_rng(2).uniform(0.0, 1.0, (7, len(families)))
    assert_allclose(found(elsewhere), known(elsewhere), atol=1e-10)


@cases
def test_moments_equal_the_sum_over_products_of_coefficients(families: Families, alpha: Alpha) -> None:
    """Eq. (3.9) as it is written, with the expectations of all products of polynomials."""
    ours = expansion(families, alpha, 2, 3)
    rules = [germ.quadrature(9) for germ in ours.germs]
    phi = np.array(list(product(*[nodes for nodes, _ in rules])))
    weights = np.array(list(product(*[w for _, w in rules]))).prod(axis=1)
    h = Expansion(ours.germs, 2, np.eye(len(ours.coefficients)))(phi).T
    for m, moment in enumerate(ours.moments(4), start=1):
        letters = "abcd"[:m]
        factors = ",".join(f"{letter}q" for letter in letters)
        expected = np.einsum(f"{factors},q->{letters}", *[h] * m, weights, optimize=True)
        for output, c in enumerate(ours.coefficients.T):
            total = expected
            for _ in range(m):
                total = total @ c
            assert_allclose(moment[output], total, rtol=1e-12)


@cases
def test_other_moments_follow_from_the_raw_ones(families: Families, alpha: Alpha) -> None:
    ours = expansion(families, alpha, 4, 5)
    raw = np.concatenate([np.ones((1, 3)), ours.moments(6)])
    assert_allclose(ours.mean, raw[1], rtol=1e-13)
    assert_allclose(ours.variance, raw[2] - raw[1] ** 2, atol=1e-15 * np.max(raw[2]))
    scaled = ours.standardised(6)
    assert_allclose(scaled[:2], [[0.0] * 3, [1.0] * 3], atol=1e-12)
    for k in range(3, 7):
        central = sum(comb(k, j) * raw[j] * (-ours.mean) ** (k - j) for j in range(k + 1))
        # the raw moments lose digits to the mean
        lost = (1.0 + np.abs(ours.mean) / np.sqrt(ours.variance)) ** k
        difference = np.abs(scaled[k - 1] - central / ours.variance ** (k / 2))
        assert np.all(difference <= 1e-13 * (lost + np.abs(scaled[k - 1])))


def test_moments_of_a_lognormal() -> None:
    """Y = exp(mu + sigma phi): E Y^m = exp(m mu + m^2 sigma^2 / 2); the variance leaves out the mean."""
    mu, sigma = 0.2, 0.1
    chaos, alpha = Chaos((Gaussian(),), 12, 13), np.array([[mu, sigma]])
    ours = chaos.expand(alpha, np.exp(chaos.nodes(alpha)))
    m = np.arange(1, 9)
    exact = np.exp(m * mu + 0.5 * (m * sigma) ** 2)
    assert_allclose(ours.moments(8)[:, 0], exact, rtol=1e-12)
    assert_allclose(ours.variance, exact[1] - exact[0] ** 2, rtol=1e-12)
    first = exact[0] * np.array([1.0, sigma, sigma**2 / 2**0.5])
    assert_allclose(ours.coefficients[:3, 0], first, rtol=1e-11)


def test_means_far_from_zero_do_not_blur_the_standardised_moments() -> None:
    chaos, alpha = Chaos((Gamma(),), 3, 4), np.array([[4.0, 1.0]])
    ours = chaos.expand(alpha, 1e8 + 0.01 * chaos.nodes(alpha))
    assert_allclose(ours.standardised(4)[2:, 0], [1.0, 4.5], rtol=1e-4)


def test_moments_agree_with_chaospy() -> None:
    chaospy = pytest.importorskip("chaospy")
    alpha = [[0.91, 0.081], [0.55, 0.046]]
    ours = expansion((Gaussian(), Gaussian()), alpha, 4, 5)
    joint = chaospy.J(*[chaospy.Normal(mu, sigma) for mu, sigma in alpha])
    basis = chaospy.generate_expansion(4, joint, normed=True)
    nodes, weights = chaospy.generate_quadrature(4, joint, rule="gaussian")
    poly, coefficients = chaospy.fit_quadrature(basis, nodes, weights, response(nodes.T), retall=1)
    assert_allclose(np.sort(ours.coefficients, axis=0), np.sort(coefficients, axis=0), atol=1e-10)
    assert_allclose(ours.mean, chaospy.E(poly, joint), rtol=1e-10)
    assert_allclose(ours.variance, chaospy.Var(poly, joint), rtol=1e-10)
    raw = [chaospy.E(poly**m, joint) for m in range(1, 5)]
    assert_allclose(ours.moments(4), raw, rtol=1e-10)
    assert_allclose(ours.standardised(4)[2], chaospy.Skew(poly, joint), atol=1e-6)


def test_what_alpha_does_not_change_is_computed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    chaos = Chaos((ClippedNormal(0.7, 1.3), Gaussian()), 2, 3)
    one, other = np.array([[0.9, 0.1], [0.0, 1.0]]), np.array([[1.1, 0.2], [2.0, 3.0]])
    chaos.expand(one, response(chaos.nodes(one))).moments(4)
    monkeypatch.setattr("numpy.linalg.eigvalsh", lambda *_: pytest.fail("quadrature computed again"))
    assert np.all(chaos.expand(other, response(chaos.nodes(other))).moments(4)[1] > 0.0)


def test_own_polynomials_keep_the_high_moments_that_hermite_loses() -> None:
    """Sixth and eighth moment of a smooth output under a normal that its interval cuts at one deviation.

    Both chaoses have the same distribution of theta, degree and number of model evaluations. Where eta is
    flat a polynomial in phi keeps growing, and its sixth power more so; a higher degree makes it worse.
    """
    alpha = np.array([[1.0, 0.3]])

    def moments(family: Family, degree: int, order: int) -> Array:
        chaos = Chaos((family,), degree, order)
        return chaos.expand(alpha, np.exp(2.0 * chaos.nodes(alpha))).standardised(8)[[5, 7], 0]

    exact = moments(TruncatedNormal(0.7, 1.3), 30, 40)
    for degree, hermite, own in ((4, (0.4, 20.0), 3e-4), (6, (10.0, 5e4), 3e-7), (8, (200.0, 5e7), 1e-10)):
        lost = np.abs(moments(ClippedNormal(0.7, 1.3), degree, degree + 1) / exact - 1.0)
        kept = np.abs(moments(TruncatedNormal(0.7, 1.3), degree, degree + 1) / exact - 1.0)
        assert np.all(lost > hermite)
        assert np.all(kept < own)


def test_expansions_refuse_what_they_cannot_use() -> None:
    family = TruncatedNormal(0.7, 1.3)
    for families, degree, order, words in (
        ((family,), 4, 4, "order must exceed the degree 4, got 4"),
        ((), 4, 5, "at least one uncertain parameter"),
        ((family,), -1, 5, "degree must not be negative, got -1"),
    ):
        with pytest.raises(BadInput, match=words):
            Chaos(families, degree, order)
    chaos, alpha = Chaos((family, family), 1, 2), np.array([[0.9, 0.1], [1.0, 0.1]])
    for wrong in (alpha[0], alpha.T[:1], np.ones((3, 2))):
        with pytest.raises(BadInput, match=r"two numbers for every parameter, shape \(2, 2\): got"):
            chaos.nodes(wrong)
    with pytest.raises(BadInput, match="parameter 2: sigma must be positive, got 0"):
        chaos.nodes(np.array([[0.9, 0.1], [1.0, 0.0]]))
    with pytest.raises(ValueError, match=r"shape \(4, L\), got \(5, 2\)"):
        chaos.expand(alpha, np.ones((5, 2)))
    values = np.ones((4, 2))
    with pytest.raises(ValueError, match="output 0 does not vary"):
        chaos.expand(alpha, values).standardised(4)
    values[2, 1] = np.nan
    with pytest.raises(ValueError, match="output 1 is nan at node 2"):
        chaos.expand(alpha, values)


def test_the_last_parameter_changes_fastest() -> None:
    chaos = Chaos((Uniform(), Uniform()), 1, 2)
    nodes = chaos.nodes(np.array([[0.0, 1.0], [5.0, 6.0]]))
    low, high = 0.5 - 0.5 / 3**0.5, 0.5 + 0.5 / 3**0.5
    assert_allclose(nodes, [[low, 5 + low], [low, 5 + high], [high, 5 + low], [high, 5 + high]])
    assert_array_equal(multi_indices(2, 1), [[0, 0], [1, 0], [0, 1]])
