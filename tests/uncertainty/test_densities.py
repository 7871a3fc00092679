"""Gaussian and empirical densities, histograms, and the Earth Mover's Distance."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from scipy import stats

from unmodelled.base.errors import BadInput
from unmodelled.uncertainty.density import Density, GaussianDensity, earth_mover_distance
from unmodelled.uncertainty.empirical import BINS, Empirical, Histogram
from unmodelled.uncertainty.maximum_entropy import MaximumEntropy

Array = NDArray[np.float64]


def test_gaussian() -> None:
    density = GaussianDensity(np.array([0.4, -3.0]), np.array([0.02, 7.0]))
    y = np.array([[0.41, 2.0], [0.3, -40.0]])
    expected = stats.norm(density.mean, density.std)
    assert_allclose(density.log_density(y), expected.logpdf(y))
    assert_allclose(density.density(y), expected.pdf(y))
    assert_allclose(density.cumulative(y), expected.cdf(y))
    assert (np.diff(density.cumulative(density.window().T), axis=0) > 1.0 - 1e-14).all()


@pytest.mark.parametrize("std", [0.0, -1.0, np.nan, np.inf])
def test_a_gaussian_needs_a_spread(std: float) -> None:
    with pytest.raises(BadInput, match="output 2 of 2 has no density"):
        GaussianDensity(np.zeros(2), np.array([1.0, std]))


def two_peaks(size: int, seed: int) -> Array:
    rng = np.random.default_rng(seed)
    return np.asarray(rng.choice([-1.0, 1.0], size) + 0.1 * rng.standard_normal(size))


#: Samples of (size, seed), density, largest mean error of its logarithm from 200 000 and from 100 samples.
CASES = {
    "gaussian": (lambda n, k: stats.norm.rvs(size=n, random_state=k), stats.norm.pdf, 0.015, 0.25),
    "skewed": (
        lambda n, k: stats.gamma.rvs(4.0, size=n, random_state=k),
        lambda y: stats.gamma.pdf(y, 4.0),
        0.015,
        0.3,
    ),
    "bounded": (
        lambda n, k: stats.truncnorm.rvs(-1.0, 2.5, size=n, random_state=k),
        lambda y: stats.truncnorm.pdf(y, -1.0, 2.5),
        0.03,
        0.25,
    ),
    "bimodal": (
        two_peaks,
        lambda y: 0.5 * (stats.norm.pdf(y, -1.0, 0.1) + stats.norm.pdf(y, 1.0, 0.1)),
        0.03,
        1.0,
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_samples_give_back_their_density(name: str) -> None:
    draw, pdf, many, few = CASES[name]
    y = draw(2000, 99)[:, None]
    for size, most in ((200_000, many), (100, few)):
        samples = np.stack([draw(size, seed) for seed in range(3)], axis=1)
        found = Empirical.of(0.4 + 0.02 * samples).log_density(0.4 + 0.02 * y * np.ones(3))
        assert np.abs(found + np.log(0.02) - np.log(pdf(y))).mean() < most


def check_density(density: Density) -> None:
    """Not negative, of integral one, and its cumulative probability its integral."""
    low, high = density.window().T
    reach = high - low
    y = np.linspace(low - reach, high + reach, 30_001)
    f = density.density(y)
    assert (f >= 0.0).all()
    assert np.isfinite(density.log_density(y)).all()
    integral = np.concatenate(
        [np.zeros((1, low.size)), np.cumsum((f[1:] + f[:-1]) * np.diff(y, axis=0) / 2, 0)]
    )
    assert_allclose(integral[-1], 1.0, atol=2e-3)
    assert_allclose(density.cumulative(y), integral, atol=5e-3)
    assert (np.diff(density.cumulative(y), axis=0) >= -1e-12).all()


@settings(max_examples=30)
@given(st.integers(25, 400), st.integers(0, 1000), st.sampled_from(sorted(CASES)))
def test_few_samples_make_a_proper_density(size: int, seed: int, name: str) -> None:
    samples = CASES[name][0](size, seed)
    check_density(Empirical.of(np.stack([samples, 1e-3 * samples + 5.0], axis=1)))


def test_samples_on_a_few_values_make_a_proper_density() -> None:
    values = np.repeat([0.0, 1.0, 1.0, 1.0, 1.0, 5.0], 20)[:, None]
    check_density(Empirical.of(values))


def test_tails_are_those_of_one_more_sample() -> None:
    samples = np.random.default_rng(0).standard_normal((1000, 1))
    density = Empirical.of(samples)
    far = np.array([[-9.0], [12.0]])
    expected = stats.norm.logpdf(far, samples.mean(), samples.std()) - np.log(1001.0)
    assert_allclose(density.log_density(far), expected, rtol=1e-3)


def test_outputs_do_not_touch_each_other() -> None:
    samples = np.random.default_rng(0).gamma(3.0, size=(500, 4)) * [1.0, 0.1, 7.0, 1e-3]
    y = samples[:50]
    together = Empirical.of(samples)
    for l in range(4):
        alone = Empirical.of(samples[:, [l]])
        assert_allclose(alone.log_density(y[:, [l]]), together.log_density(y)[:, [l]], rtol=1e-9)
        assert_allclose(alone.window()[0], together.window()[l])


@settings(max_examples=20)
@given(st.integers(2, 40), st.integers(0, 1000))
def test_chunks_count_as_much_as_all_at_once(chunks: int, seed: int) -> None:
    """Each bin holds what lies between its ends, however often the range had to grow."""
    samples = np.random.default_rng(seed).standard_cauchy((400, 2))
    histogram = Histogram()
    for chunk in np.array_split(samples, chunks):
        histogram.add(chunk)
    assert histogram.size == 400
    for l in range(2):
        edges = histogram.low[l] + histogram.width[l] * np.arange(BINS + 1)
        expected = np.searchsorted(np.sort(samples[:, l]), edges)
        found = np.concatenate([[0.0], np.cumsum(histogram.counts[:, l])])
        assert found[-1] == 400.0
        assert np.abs(found - expected).max() <= 1.0  # a sample on an edge may round either way


def test_chunks_give_the_same_density() -> None:
    samples = np.random.default_rng(0).standard_normal((50_000, 3))
    histogram = Histogram()
    for chunk in np.array_split(samples, 50):
        histogram.add(chunk)
    y = np.linspace(-2.5, 2.5, 50)[:, None] * np.ones(3)
    found = Empirical.from_histogram(histogram).log_density(y)
    assert_allclose(found, Empirical.of(samples).log_density(y), atol=0.02)


def test_samples_that_make_no_density() -> None:
    good = np.random.default_rng(0).standard_normal((30, 3))
    with pytest.raises(BadInput, match="samples of output 2 of 3 are not finite"):
        Empirical.of(np.where(good == good[4, 1], np.nan, good))
    with pytest.raises(BadInput, match="samples of output 3 of 3 are all equal"):
        Empirical.of(good * [1.0, 1.0, 0.0] + 0.1)
    with pytest.raises(ValueError, match="no samples"):
        Empirical.from_histogram(Histogram())


def test_distance_of_shifted_gaussians_is_the_shift() -> None:
    std = np.array([1.0, 0.05])
    p, q = GaussianDensity(np.zeros(2), std), GaussianDensity(np.array([0.3, -2.0]), std)
    assert_allclose(earth_mover_distance(p, q), [0.3, 2.0], rtol=1e-5)
    assert_allclose(earth_mover_distance(q, p), earth_mover_distance(p, q))
    assert_allclose(earth_mover_distance(p, p), 0.0)


@settings(max_examples=20)
@given(st.floats(-0.8, 0.8), st.floats(0.3, 3.0), st.floats(-1.0, 1.0))
def test_distance_is_the_transport_of_atoms(skewness: float, spread: float, shift: float) -> None:
    """Appendix 3.7 as a transport between signatures, solved by scipy on a fine grid."""
    moments = np.array([0.0, 1.0, skewness, 3.2 + skewness**2])[:, None]
    p: Density = MaximumEntropy.fit(np.zeros(1), np.ones(1), moments)
    q: Density = GaussianDensity(np.array([shift]), np.array([spread]))
    y = np.linspace(-26.0, 26.0, 40_001)
    weights = (np.diff(d.cumulative(y[:, None])[:, 0]).clip(0.0) for d in (p, q))
    middle = 0.5 * (y[1:] + y[:-1])
    expected = stats.wasserstein_distance(middle, middle, *weights)
    assert earth_mover_distance(p, q)[0] == pytest.approx(expected, abs=3e-4)
