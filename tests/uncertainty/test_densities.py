"""Densities from samples, from two moments and of largest entropy, and the Earth Mover's Distance."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy import stats
from scipy.integrate import cumulative_trapezoid, quad
from scipy.special import roots_legendre

from pipeline.uncertainty.empirical import BINS, Empirical, Histogram
from pipeline.uncertainty.references import earth_mover_distance
from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.uncertainty.density import REACH, Density, GaussianDensity
from unmodelled.uncertainty.maximum_entropy import MaximumEntropy


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
    "gaussian": (stats.norm().rvs, stats.norm.pdf, 0.015, 0.25),
    "skewed": (stats.gamma(4.0).rvs, stats.gamma(4.0).pdf, 0.015, 0.3),
    "bounded": (stats.truncnorm(-1.0, 2.5).rvs, stats.truncnorm(-1.0, 2.5).pdf, 0.03, 0.25),
    "bimodal": (two_peaks, lambda y: stats.norm.pdf(y, [[-1.0], [1.0]], 0.1).mean(0), 0.03, 1.0),
}


@pytest.mark.parametrize("name", CASES)
def test_samples_give_back_their_density(name: str) -> None:
    draw, pdf, many, few = CASES[name]
    y = draw(2000, 99)
    for size, most in ((200_000, many), (100, few)):
        samples = np.stack([draw(size, seed) for seed in range(3)], axis=1)
        found = Empirical.of(0.4 + 0.02 * samples).log_density(0.4 + 0.02 * y[:, None] * np.ones(3))
        assert np.abs(found + np.log(0.02) - np.log(pdf(y))[:, None]).mean() < most


def check_density(density: Density) -> None:
    """Not negative, of integral one, and its cumulative probability its integral."""
    low, high = density.window().T
    reach = high - low
    y = np.linspace(low - reach, high + reach, 30_001)
    f = density.density(y)
    assert (f >= 0.0).all()
    assert np.isfinite(density.log_density(y)).all()
    integral = cumulative_trapezoid(f, y, axis=0, initial=0.0)
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


Pdf = Callable[[Array], Array]
NODES, WEIGHTS = roots_legendre(1000)


def rule(low: float, high: float) -> tuple[Array, Array]:
    return low + 0.5 * (high - low) * (NODES + 1.0), 0.5 * (high - low) * WEIGHTS


def moments_of(pdf: Pdf, low: float, high: float, count: int = 4) -> tuple[Array, Array, Array]:
    """Mean (1,), standard deviation (1,), standardised moments (count, 1)."""
    y, w = rule(low, high)
    q = w * pdf(y)
    q /= q.sum()
    mean = q @ y
    std = np.sqrt(q @ (y - mean) ** 2)
    higher = [q @ ((y - mean) / std) ** k for k in range(1, count + 1)]
    return np.array([mean]), np.array([std]), np.array(higher)[:, None]


def check_moments(fit: MaximumEntropy, moments: Array) -> None:
    """By a rule of its own, in every output."""
    assert not fit.fallback.any()
    for l, (low, high) in enumerate(fit.window()):
        y, w = rule(low, high)
        q = w * fit.density(np.broadcast_to(y[:, None], (y.size, len(fit.mean))))[:, l]
        found = [q @ ((y - fit.mean[l]) / fit.std[l]) ** k for k in range(len(moments) + 1)]
        expected = np.append(1.0, moments[:, l])
        assert_allclose(found, expected, rtol=1e-8, atol=1e-8)


@st.composite
def mixtures(draw: st.DrawFn) -> tuple[Pdf, float, float]:
    part = st.tuples(st.floats(-2.0, 2.0), st.floats(0.15, 1.0), st.floats(0.1, 1.0))
    parts = draw(st.lists(part, min_size=2, max_size=3))

    def pdf(y: Array) -> Array:
        return np.sum([share * stats.norm.pdf(y, mean, std) for mean, std, share in parts], axis=0)

    return pdf, -12.0, 12.0


@st.composite
def betas(draw: st.DrawFn) -> tuple[Pdf, float, float]:
    a, b = draw(st.floats(1.0, 20.0)), draw(st.floats(1.0, 20.0))
    return (lambda y: stats.beta.pdf(y, a, b)), 0.0, 1.0


@st.composite
def truncated_normals(draw: st.DrawFn) -> tuple[Pdf, float, float]:
    low, length = draw(st.floats(-3.0, 3.0)), draw(st.floats(0.2, 5.0))
    return (lambda y: stats.norm.pdf(y)), low, low + length


anything = st.one_of(mixtures(), betas(), truncated_normals())


@settings(max_examples=60)
@given(anything)
def test_four_moments_are_matched(case: tuple[Pdf, float, float]) -> None:
    pdf, low, high = case
    mean, std, moments = moments_of(pdf, low, high)
    for support in (None, np.array([[low, high]])):
        check_moments(MaximumEntropy.fit(mean, std, moments, support), moments)


@settings(max_examples=30)
@given(st.one_of(betas(), truncated_normals()), st.sampled_from([3, 5, 6, 8]))
def test_any_number_of_moments_is_matched_on_the_support(case: tuple[Pdf, float, float], count: int) -> None:
    pdf, low, high = case
    mean, std, moments = moments_of(pdf, low, high, count)
    check_moments(MaximumEntropy.fit(mean, std, moments, np.array([[low, high]])), moments)


@settings(max_examples=30)
@given(anything)
def test_no_density_of_these_moments_has_more_entropy(case: tuple[Pdf, float, float]) -> None:
    pdf, low, high = case
    mean, std, moments = moments_of(pdf, low, high, 4)
    fit = MaximumEntropy.fit(mean, std, moments, np.array([[low, high]]))
    low, high = fit.window()[0]
    y, w = rule(low, high)
    f = pdf(y) / (w @ pdf(y))
    entropy = -(w * f) @ np.log(np.maximum(f, 1e-300))
    log_fit = fit.log_density(y[:, None])[:, 0]
    assert -(w * np.exp(log_fit)) @ log_fit >= entropy - 1e-7


@settings(max_examples=30)
@given(st.floats(-0.3, 0.3), st.floats(-1.0, 3.0), st.floats(0.2, 1.0))
@example(0.0, 3.0, 0.5)  # two peaks
def test_the_exponential_of_a_polynomial_is_found_again(tilt: float, bulge: float, drop: float) -> None:
    def pdf(y: Array) -> Array:
        return np.exp(np.maximum(tilt * y + bulge * y**2 - drop * y**4, -300.0))

    mean, std, moments = moments_of(pdf, -9.0, 9.0, 4)
    y, w = rule(-9.0, 9.0)
    expected = np.log(pdf(y)) - np.log(w @ pdf(y))
    seen = expected > -15.0
    fit = MaximumEntropy.fit(mean, std, moments)
    found = fit.log_density(y[:, None])[:, 0]
    assert_allclose(found[seen], expected[seen], atol=1e-5)


def test_two_moments_make_the_gaussian() -> None:
    mean, std = np.array([0.4, -30.0]), np.array([0.01, 5.0])
    fit = MaximumEntropy.fit(mean, std, np.array([[0.0, 0.0], [1.0, 1.0]]))
    y = mean + std * np.linspace(-7.9, 7.9, 50)[:, None]
    assert_allclose(fit.log_density(y), GaussianDensity(mean, std).log_density(y), atol=1e-9)
    assert_allclose(fit.cumulative(y), GaussianDensity(mean, std).cumulative(y), atol=1e-10)
    assert_allclose(fit.window(), GaussianDensity(mean, std).window())


def test_fits_of_outputs_do_not_touch_each_other() -> None:
    rng = np.random.default_rng(0)
    a, b = rng.uniform(1.0, 9.0, (2, 20))
    skewness, excess = stats.beta.stats(a, b, moments="sk")
    moments = np.stack([np.zeros(20), np.ones(20), skewness, 3.0 + excess])
    mean, std = rng.uniform(0.4, 2.0, 20), rng.uniform(0.01, 0.2, 20)
    y = mean + 0.7 * std
    together = MaximumEntropy.fit(mean, std, moments)
    for l in range(20):
        one = [l]
        alone = MaximumEntropy.fit(mean[one], std[one], moments[:, one])
        assert_allclose(alone.log_density(y[one]), together.log_density(y)[one], rtol=1e-12, atol=1e-12)
        assert_allclose(alone.cumulative(y[one]), together.cumulative(y)[one], rtol=1e-12)


@pytest.mark.parametrize("support", [None, [[0.0, 1.0], [0.0, 1.0]]])
def test_cumulative_probability_is_the_integral_of_the_density(support: list[list[float]] | None) -> None:
    one = moments_of(lambda y: stats.beta.pdf(y, 2.0, 6.0), 0.0, 1.0, 4)
    two = moments_of(lambda y: stats.norm.pdf(y, 0.3, 0.04) + 0.5 * stats.norm.pdf(y, 0.7, 0.05), 0.0, 1.0, 4)
    mean, std, moments = (np.concatenate(pair, axis=-1) for pair in zip(one, two, strict=True))
    fit = MaximumEntropy.fit(mean, std, moments, None if support is None else np.array(support))
    y = np.linspace(-0.1, 1.1, 25)[:, None] * np.ones(2)
    found = fit.cumulative(y)
    for l in range(2):
        low = fit.window()[l, 0]

        def density(point: float, l: int = l) -> float:
            return float(fit.density(np.full(2, point))[l])

        for row in range(25):
            middle = float(np.clip(mean[l], low, max(low, y[row, l])))
            ends = [(low, middle), (middle, min(max(low, y[row, l]), fit.window()[l, 1]))]
            expected = sum(quad(density, *e, epsabs=1e-11, limit=400)[0] for e in ends)
            assert found[row, l] == pytest.approx(expected, abs=1e-8)
    assert (np.diff(found, axis=0) >= 0.0).all()


def test_shapes_and_values_beyond_the_support() -> None:
    mean, std, moments = moments_of(lambda y: stats.beta.pdf(y, 2.0, 3.0), 0.0, 1.0, 4)
    fit = MaximumEntropy.fit(mean, std, moments, np.array([[0.0, 1.0]]))
    y = np.array([[[-np.inf], [-0.01], [0.5]], [[1.01], [np.inf], [np.nan]]])
    assert fit.log_density(y).shape == fit.cumulative(y).shape == y.shape
    assert np.isfinite(fit.log_density(fit.window().T)).all()
    assert_allclose(fit.cumulative(y).ravel()[[0, 1, 3, 4, 5]], [0.0, 0.0, 1.0, 1.0, np.nan])
    assert (fit.density(y).ravel()[[0, 1, 3, 4]] == 0.0).all()
    assert np.isnan(fit.log_density(y)[1, 2, 0])


def test_support_may_be_open() -> None:
    mean, std, moments = moments_of(lambda y: stats.gamma.pdf(y, 3.0), 0.0, 60.0, 4)
    fit = MaximumEntropy.fit(mean, std, moments, np.array([[0.0, np.inf]]))
    assert_allclose(fit.window(), [[0.0, mean[0] + REACH * std[0]]], atol=1e-12)


@pytest.mark.parametrize("skewness, kurtosis", [(0.0, 0.9), (1.0, 1.5), (2.0, 5.0), (0.0, 80.0)])
def test_impossible_moments_fall_back_to_the_gaussian(skewness: float, kurtosis: float) -> None:
    """The first two are of no density at all, the third of two points, the last of none in the window."""
    moments = np.array([[0.0, 0.0], [1.0, 1.0], [skewness, 0.3], [kurtosis, 3.2]])
    mean, std = np.array([1.0, 2.0]), np.array([0.1, 0.2])
    fit = MaximumEntropy.fit(mean, std, moments)
    assert fit.fallback.tolist() == [True, False]
    assert (fit.iterations > 0).all()
    y = np.array([1.07, 2.1])
    assert_allclose(fit.log_density(y)[0], GaussianDensity(mean, std).log_density(y)[0], atol=1e-12)
    assert_allclose(fit.cumulative(y)[0], GaussianDensity(mean, std).cumulative(y)[0], atol=1e-10)
    alone = MaximumEntropy.fit(mean[1:], std[1:], moments[:, 1:])
    assert_allclose(fit.log_density(y)[1], alone.log_density(y[1:])[0], rtol=1e-12)


def test_the_fallback_stays_in_the_support() -> None:
    support = np.array([[0.5, 1.1]])
    moments = np.array([[0.0], [1.0], [0.0], [0.5]])
    fit = MaximumEntropy.fit(np.array([1.0]), np.array([0.2]), moments, support)
    expected = stats.truncnorm(-2.5, 0.5, 1.0, 0.2)
    assert fit.fallback.all()
    y = np.linspace(0.5, 1.0999, 7)[:, None]
    assert_allclose(fit.cumulative(y), expected.cdf(y), atol=1e-10)
    assert_allclose(fit.density(y), expected.pdf(y), rtol=1e-10)


GOOD = np.array([[0.0, 0.0], [1.0, 1.0], [0.1, 0.2], [3.0, 3.1]])


@pytest.mark.parametrize(
    "std, moments, support, message",
    [
        ([1.0, 1.0], GOOD[:1], None, "moments must be at least 2, got 1"),
        ([1.0, 0.0], GOOD, None, "output 2 of 2 has no density: mean 1, standard deviation 0"),
        ([-1.0, 1.0], GOOD, None, "output 1 of 2 has no density"),
        ([np.nan, 1.0], GOOD, None, "output 1 of 2 has no density"),
        ([1.0, 1.0], np.where(GOOD == 3.1, np.inf, GOOD), None, "moment 4 of output 2 of 2 is inf"),
        ([1.0, 1.0], GOOD, [[0.0, 2.0], [1.0, 2.0]], r"output 2 of 2 has its mean 1 outside .* \[1, 2\]"),
        ([1.0, 1.0], GOOD, [[0.0, 2.0], [0.0, np.nan]], "output 2 of 2 has its mean 1 outside"),
    ],
)
def test_what_cannot_be_fitted_is_named(
    std: list[float], moments: Array, support: list[list[float]] | None, message: str
) -> None:
    ends = None if support is None else np.array(support)
    with pytest.raises(BadInput, match=message):
        MaximumEntropy.fit(np.ones(2), np.array(std), moments, ends)


def test_raw_moments_and_wrong_shapes_are_refused() -> None:
    with pytest.raises(ValueError, match="not standardised"):
        MaximumEntropy.fit(np.ones(2), np.ones(2), GOOD + 0.1)
    with pytest.raises(ValueError, match="do not agree"):
        MaximumEntropy.fit(np.ones(3), np.ones(3), GOOD)
    with pytest.raises(ValueError, match="support has shape"):
        MaximumEntropy.fit(np.ones(2), np.ones(2), GOOD, np.array([[0.0, 2.0]]))
