"""Families of parameter distributions: each is one distribution, seen from its density, quantile and germ."""

import importlib
import inspect
import pkgutil
from collections.abc import Callable, Iterator

import mpmath
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.special import roots_genlaguerre, roots_hermitenorm, roots_jacobi, roots_legendre

from tests.uncertainty.other_families import Beta, Gamma, Gaussian, Jacobi, Laguerre, Uniform
from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.uncertainty import families
from unmodelled.uncertainty.chaos import Chaos
from unmodelled.uncertainty.families import ClippedNormal, Family, TruncatedNormal
from unmodelled.uncertainty.families.orthogonal import Germ, Hermite

NORMALS = ((0.91, 0.081), (0.75, 0.3), (1.0, 0.002), (0.3, 0.05), (1.6, 0.1))
MEMBERS: dict[type[Family], list[tuple[Family, tuple[float, float]]]] = {
    Gaussian: [(Gaussian(), (0.0, 1.0)), (Gaussian(), (-3.0, 0.02))],
    Gamma: [(Gamma(), (1.0, 2.0)), (Gamma(), (2.5, 0.1)), (Gamma(), (40.0, 0.01))],
    Beta: [(Beta(0.7, 1.3), (2.0, 5.0)), (Beta(-1.0, 1.0), (1.0, 1.0)), (Beta(0.0, 9.0), (12.5, 3.0))],
    Uniform: [(Uniform(), (-1.0, 1.0)), (Uniform(), (0.4, 0.45))],
    ClippedNormal: [(ClippedNormal(0.7, 1.3), alpha) for alpha in NORMALS],
    TruncatedNormal: [(TruncatedNormal(0.7, 1.3), alpha) for alpha in NORMALS],
}


def concrete(family: type[Family]) -> Iterator[type[Family]]:
    for below in family.__subclasses__():
        if not inspect.isabstract(below):
            yield below
        yield from concrete(below)


for module in pkgutil.iter_modules(families.__path__):
    importlib.import_module(f"{families.__name__}.{module.name}")
EVERY = sorted(concrete(Family), key=lambda family: family.__name__)
members = pytest.mark.parametrize(
    ("family", "alpha"),
    [
        pytest.param(member, np.array(alpha), id=f"{family.__name__}{alpha}")
        for family in EVERY
        for member, alpha in MEMBERS.get(family, [])
    ],
)


def test_every_family_is_exported_and_has_members() -> None:
    exported = {getattr(families, name) for name in families.__all__}
    ours = {family for family in EVERY if family.__module__.startswith(families.__name__)}
    assert ours <= exported, "name the new family in unmodelled/uncertainty/families/__init__.py"
    assert set(EVERY) == set(MEMBERS), "give MEMBERS above some distributions of the new family"


def integral(values_at: Callable[[Array], Array], breaks: Array) -> Array:
    """Of a function over every panel between the breaks."""
    x, w = roots_legendre(24)
    half = 0.5 * np.diff(breaks)[:, None]
    points = 0.5 * (breaks[1:] + breaks[:-1])[:, None] + half * x
    return np.sum(values_at(points) * half * w, axis=-1)


def germ_breaks(germ: Germ) -> Array:
    """Panels over all that counts of a germ."""
    nodes, _ = germ.quadrature(60)
    low, high = germ.support
    reach = nodes[-1] - nodes[0]
    return np.concatenate([[max(low, nodes[0] - reach)], nodes, [min(high, nodes[-1] + reach)]])


@members
def test_density_integrates_to_cumulative(family: Family, alpha: Array) -> None:
    theta = family.quantile(np.array([1e-9, 1e-6, 1e-3, 0.01, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99, 0.999]), alpha)
    gained = integral(lambda x: family.density(x, alpha), theta)
    assert_allclose(gained, np.diff(family.cumulative(theta, alpha)), rtol=1e-9, atol=1e-14)


@members
def test_nothing_lies_outside_the_support(family: Family, alpha: Array) -> None:
    for end, outside, below in zip(family.support(alpha), (-0.1, 0.1), (0.0, 1.0), strict=True):
        if np.isfinite(end):
            assert family.density(np.array(end + outside), alpha) == 0.0
            assert_allclose(family.cumulative(np.array([end, end + outside]), alpha), below, atol=1e-15)
            assert_allclose(family.quantile(np.array(below), alpha), end, rtol=1e-12)


@members
def test_quantile_inverts_cumulative(family: Family, alpha: Array) -> None:
    p = np.array([[1e-12, 1e-6, 0.02, 0.4], [0.5, 0.8, 0.99, 1.0 - 1e-9]])
    theta = family.quantile(p, alpha)
    assert np.all(np.diff(theta.ravel()) > 0.0)
    # a probability is not known better than theta is
    slack = np.spacing(np.abs(theta)) * family.density(theta, alpha)
    assert np.all(np.abs(family.cumulative(theta, alpha) - p) <= 1e-12 * p + 1e-15 + 4.0 * slack)


@members
def test_polynomials_are_orthonormal_under_the_germ(family: Family, alpha: Array) -> None:
    germ = family.germ(alpha)
    products = integral(
        lambda phi: germ.density(phi) * np.einsum("i...,j...->ij...", *[germ.polynomials(phi, 8)] * 2),
        germ_breaks(germ),
    )
    assert_allclose(np.sum(products, axis=-1), np.eye(9), atol=1e-9)


@members
def test_quadrature_integrates_polynomials(family: Family, alpha: Array) -> None:
    """Twelve points, all products up to degree 2 x 12 - 1."""
    germ = family.germ(alpha)
    nodes, weights = germ.quadrature(12)
    h = germ.polynomials(nodes, 12)
    assert_allclose((h[:12] * weights) @ h[:12].T, np.eye(12), atol=1e-11)
    assert_allclose(h[12], 0.0, atol=1e-6)


@members
def test_eta_carries_the_germ_to_the_family(family: Family, alpha: Array) -> None:
    """Theta = eta(phi) lies between two values as often as phi between theirs."""
    germ = family.germ(alpha)
    phi = germ_breaks(germ)
    theta = family.to_theta(phi, alpha)
    assert np.all(np.diff(theta) >= 0.0)
    gained = np.cumsum(integral(germ.density, phi))
    assert_allclose(gained, family.cumulative(theta[1:], alpha), atol=1e-9)


def moments_of_theta(family: Family, alpha: Array) -> tuple[float, float]:
    """Mean and variance by integration of the density."""
    tail = np.logspace(-15, -0.5, 60)
    theta = family.quantile(np.concatenate([tail, 1.0 - tail[::-1]]), alpha)
    mean = np.sum(integral(lambda x: x * family.density(x, alpha), theta))
    return mean, np.sum(integral(lambda x: (x - mean) ** 2 * family.density(x, alpha), theta))


def is_bent(family: Family, alpha: Array) -> bool:
    """Whether theta is no straight line over phi, so that polynomials follow it slowly."""
    phi, _ = family.germ(alpha).quadrature(6)
    slopes = np.diff(family.to_theta(phi, alpha)) / np.diff(phi)
    return bool(np.ptp(slopes) > 1e-6 * np.max(slopes))


@members
def test_expansion_of_theta_has_its_mean_and_variance(family: Family, alpha: Array) -> None:
    mean, variance = moments_of_theta(family, alpha)
    bent = is_bent(family, alpha)
    for degree, order in ((30, 60),) if bent else ((1, 2), (2, 3), (4, 5), (6, 9)):
        chaos = Chaos((family,), degree, order)
        expansion = chaos.expand(alpha[None], chaos.nodes(alpha[None]))
        assert_allclose(expansion.mean, mean, rtol=1e-12, atol=(1e-4 if bent else 1e-9) * variance**0.5)
        assert_allclose(expansion.variance, variance, rtol=1e-3 if bent else 1e-9)


@pytest.mark.parametrize("family", EVERY)
def test_wrong_numbers_are_named(family: type[Family]) -> None:
    member, alpha = MEMBERS[family][0]
    for k, name in enumerate(member.names):
        for bad in (np.nan, np.inf, *((0.0, -1.0) if name in member.positive else ())):
            wrong = np.array(alpha)
            wrong[k] = bad
            with pytest.raises(BadInput, match=f"^{name} must be (finite|positive), got {bad:g}$"):
                member.check(wrong)
    with pytest.raises(BadInput, match=f"two numbers {member.names[0]} and {member.names[1]}"):
        member.check(np.zeros(3))


def test_intervals_have_an_inside() -> None:
    with pytest.raises(BadInput, match="low must be less than high and both finite, got 1 and 1"):
        Uniform().check(np.array([1.0, 1.0]))
    for bounded in (Beta, ClippedNormal, TruncatedNormal):
        with pytest.raises(BadInput, match="low must be less than high and both finite, got 0 and inf"):
            bounded(0.0, np.inf)


@pytest.mark.parametrize("order", [1, 2, 5, 40])
def test_rules_are_those_of_table_3_1(order: int) -> None:
    peers = [
        (Hermite(), roots_hermitenorm(order)),
        (Jacobi(1.0, 1.0), roots_legendre(order)),
        (Jacobi(0.5, 0.5), roots_jacobi(order, -0.5, -0.5)),
        (Jacobi(0.3, 2.5), roots_jacobi(order, 1.5, -0.7)),
        (Laguerre(0.4), roots_genlaguerre(order, -0.6)),
        (Laguerre(7.0), roots_genlaguerre(order, 6.0)),
    ]
    for germ, (nodes, weights) in peers:
        ours, share = germ.quadrature(order)
        assert_allclose(ours, nodes, rtol=1e-10, atol=1e-12)
        assert_allclose(share, weights / weights.sum(), rtol=1e-8)


means = st.floats(-2.0, 4.0)
deviations = st.floats(0.002, 0.5)


@given(means, deviations)
@example(0.7, 0.002)
@example(-2.0, 0.002)
@example(4.0, 0.002)
def test_truncated_normal_everywhere(mu: float, sigma: float) -> None:
    """Mean and variance of the rule against closed forms in many digits, also with the mean far outside."""
    family, alpha = TruncatedNormal(0.7, 1.3), np.array([mu, sigma])
    nodes, weights = family.germ(alpha).quadrature(5)
    theta = family.to_theta(nodes, alpha)
    assert np.all((theta > 0.7) & (theta < 1.3))
    mean, variance = exact_mean_and_variance(mu, sigma)
    deviation = variance**0.5
    assert abs(weights @ theta - mean) <= 1e-11 * deviation + 2e-16 * len(theta)
    centred = nodes - weights @ nodes
    assert_allclose(weights @ centred**2 * sigma**2, variance, rtol=1e-9)


def exact_mean_and_variance(mu: float, sigma: float) -> tuple[float, float]:
    with mpmath.workdps(60):
        a, b = ((mpmath.mpf(end) - mu) / sigma for end in (0.7, 1.3))
        if a + b > 0:  # the lower tails have the digits
            mass = (mpmath.erfc(a / mpmath.sqrt(2)) - mpmath.erfc(b / mpmath.sqrt(2))) / 2
        else:
            mass = (mpmath.erfc(-b / mpmath.sqrt(2)) - mpmath.erfc(-a / mpmath.sqrt(2))) / 2
        at_a, at_b = mpmath.npdf(a) / mass, mpmath.npdf(b) / mass
        mean = at_a - at_b
        variance = 1 + a * at_a - b * at_b - mean**2
        return float(mu + sigma * mean), float(sigma**2 * variance)


@given(means, deviations, st.floats(-9.0, 9.0))
@example(-2.0, 0.002, 0.0)
@example(4.0, 0.002, 0.0)
def test_clipped_normal_is_the_same_from_either_side(mu: float, sigma: float, phi: float) -> None:
    here = ClippedNormal(0.7, 1.3).to_theta(np.array(phi), np.array([mu, sigma]))
    mirrored = ClippedNormal(-1.3, -0.7).to_theta(np.array(-phi), np.array([-mu, sigma]))
    assert 0.7 <= here <= 1.3
    assert here == -mirrored


@pytest.mark.parametrize(("mu", "sigma"), [(0.91, 0.081), (-1.0, 0.05), (3.0, 0.05), (1.0, 2.0)])
def test_clipped_normal_keeps_its_digits_in_the_tails(mu: float, sigma: float) -> None:
    """Eq. (3.12) in 320 digits, to the rounding of theta."""
    phi = np.array([-8.0, -3.0, 0.0, 1.0, 5.0, 8.0])
    theta = ClippedNormal(0.7, 1.3).to_theta(phi, np.array([mu, sigma]))
    with mpmath.workdps(320):
        a, b = ((mpmath.mpf(end) - mu) / sigma for end in (0.7, 1.3))
        for one, found in zip(phi, theta, strict=True):
            at, mass = (mpmath.mpf(float(found)) - mu) / sigma, mpmath.ncdf(b) - mpmath.ncdf(a)
            share = (mpmath.ncdf(at) - mpmath.ncdf(a)) / mass
            density = mpmath.npdf(at) / sigma / mass
            off = float((share - mpmath.ncdf(mpmath.mpf(float(one)))) / density)
            assert abs(off) < 5e-15
