"""From alpha to densities by every way, against closed forms, slow quadrature and Monte Carlo."""

import numpy as np
import pytest
from scipy.stats import kurtosis, lognorm, norm, skew

from pipeline.uncertainty.moments import of_moments, sample_moments
from pipeline.uncertainty.references import monotone_density
from pipeline.uncertainty.sampled import MonteCarlo, QuasiMonteCarlo, even_grid
from tests.uncertainty.other_families import Gaussian, Uniform
from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.uncertainty.chaos import Chaos
from unmodelled.uncertainty.density import GaussianDensity
from unmodelled.uncertainty.families import ClippedNormal, Family, TruncatedNormal
from unmodelled.uncertainty.likelihood import at_data, floored, log_likelihoods, objective, tail_floor
from unmodelled.uncertainty.maximum_entropy import MaximumEntropy
from unmodelled.uncertainty.propagation import (
    ChaosGaussian,
    ChaosMaximumEntropy,
    ExactPushForward,
    Propagation,
)
from unmodelled.uncertainty.push_forward import PushForward
from unmodelled.uncertainty.response import Formula, evaluate_response
from unmodelled.uncertainty.sampling import data_sets, draw
from unmodelled.uncertainty.surface import ResponseSurface

NAMES = ("theta_1", "theta_2")
BOX = np.array([[0.7, 1.3], [0.4, 1.15]])
CLIPPED = (ClippedNormal(0.7, 1.3), ClippedNormal(0.4, 1.15))
CLUTCH = np.array([[0.91, 0.081], [0.55, 0.046]])


def kinked(theta: Array) -> Array:
    """Three outputs whose slopes jump along lines across the box; the last falls along the second axis."""
    x, y = theta.T
    first = 0.5 * x + 0.2 * y + np.maximum(0.0, x + 0.6 * y - 1.3)
    second = 0.5 * x + 0.2 * y**2 + 2.0 * np.maximum(0.0, x + 0.3 * y - 1.1)
    return np.stack([first, second, 0.4 * x**2 - 0.3 * y + np.maximum(0.0, x - 0.6 * y - 0.5)], axis=1)


KINKED = ResponseSurface.of(Formula(NAMES, BOX, kinked), (15, 9))


def slowly(y: float, output: int, alpha: Array) -> float:
    """Density of an output by an integral over theta_1, with theta_2 where the surface is y, by bisection."""
    levels = np.array([1e-14, 1.0 - 1e-14])
    low, high = CLIPPED[0].quantile(levels, alpha[0])
    x = low + (high - low) * (np.arange(3000) + 0.5) / 3000

    def value(t: Array) -> Array:
        return KINKED(np.stack([x, t], axis=1))[:, output]

    start, end = np.full_like(x, BOX[1, 0]), np.full_like(x, BOX[1, 1])
    met = (value(start) - y) * (value(end) - y) < 0.0
    rising = value(end) > value(start)
    for _ in range(30):
        middle = 0.5 * (start + end)
        ahead = (value(middle) < y) == rising
        start, end = np.where(ahead, middle, start), np.where(ahead, end, middle)
    t = np.clip(middle, BOX[1, 0] + 1e-6, BOX[1, 1] - 1e-6)
    slope = np.abs(value(t + 1e-6) - value(t - 1e-6)) / 2e-6
    mass = CLIPPED[0].density(x, alpha[0]) * CLIPPED[1].density(t, alpha[1])
    return float((high - low) * np.mean(np.where(met, mass / slope, 0.0)))


@pytest.mark.parametrize("sigma", [(0.1, 0.2), (0.2, 0.005), (0.005, 0.2), (0.005, 0.005)])
def test_a_lognormal_output_has_its_own_density(sigma: tuple[float, float]) -> None:
    slopes = np.array([[1.0, 0.5], [-0.7, 0.4], [-0.2, -1.5], [0.02, 1.0], [1.0, 0.0]])
    alpha = np.array([[0.2, sigma[0]], [-0.1, sigma[1]]])
    bounds = alpha[:, :1] + alpha[:, 1:] * [-6.0, 6.0]
    surface = ResponseSurface.of(Formula(NAMES, bounds, lambda t: np.exp(t @ slopes.T)), (101, 101))
    shape = np.sqrt((slopes**2) @ alpha[:, 1] ** 2)
    exact = lognorm(s=shape, scale=np.exp(slopes @ alpha[:, 0]))
    y = exact.ppf(np.array([1e-4, 0.01, 0.3, 0.5, 0.9, 0.999])[:, None])
    density = PushForward(surface, (Gaussian(), Gaussian()), alpha)
    np.testing.assert_allclose(density.log_density(y), exact.logpdf(y), atol=3e-3)
    np.testing.assert_allclose(density.cumulative(y), exact.cdf(y), atol=2e-4)


@pytest.mark.parametrize(
    "sigma", [(0.005, 0.2), (0.2, 0.005), (0.002, 0.0025), (0.05, 0.01), (0.2, 0.2), (0.05, 0.1)]
)
def test_it_equals_the_integral_of_the_text(sigma: tuple[float, float]) -> None:
    alpha = np.stack([[0.91, 0.6], sigma], axis=1)
    y = np.diagonal(KINKED(draw(CLIPPED, alpha, 3, np.random.default_rng(1)))).copy()
    slow = np.log([slowly(value, output, alpha) for output, value in enumerate(y)])
    np.testing.assert_allclose(PushForward(KINKED, CLIPPED, alpha).log_density(y), slow, atol=0.01)
    np.testing.assert_allclose(KINKED.at(y).log_density(CLIPPED, alpha[None])[0], slow, atol=0.01)


def test_cumulative_probability_is_the_integral_of_the_density() -> None:
    exact = PushForward(KINKED, CLIPPED, CLUTCH)
    low, high = exact.window().T
    y = np.linspace(low, high, 4001)
    below = exact.cumulative(y)
    assert np.all(np.diff(below, axis=0) >= 0.0)
    np.testing.assert_allclose(below[0], 0.0, atol=1e-8)
    np.testing.assert_allclose(below[-1], 1.0, atol=1e-6)
    areas = 0.5 * (exact.density(y)[1:] + exact.density(y)[:-1]) * np.diff(y, axis=0)
    difference = np.abs(np.cumsum(areas, axis=0) - below[1:])
    assert difference.max() < 3e-3  # at a kink
    assert difference.mean() < 1e-4
    assert np.all(exact.log_density(np.stack([high + 1.0, low - 1.0])) == -np.inf)


def test_densities_that_jump_are_met_where_they_do() -> None:
    families, alpha = (Uniform(), Uniform()), np.array([[0.8, 1.2], [0.5, 1.0]])
    surface = ResponseSurface.of(Formula(NAMES, BOX, lambda t: t.sum(1, keepdims=True)), (4, 3))
    exact = PushForward(surface, families, alpha)
    y = np.array([[1.25], [1.4], [1.701], [1.9], [2.1999], [2.3]])
    trapezoid = np.minimum(np.minimum(y - 1.3, 0.4), 2.2 - y).clip(0.0) / 0.2
    np.testing.assert_allclose(exact.density(y), trapezoid, atol=1e-10)
    np.testing.assert_allclose(exact.cumulative(np.array([[1.5], [1.75]])), [[0.1], [0.5]], atol=1e-6)


def test_one_monotone_axis_is_enough() -> None:
    def waves(theta: Array) -> Array:
        along, across = theta[:, 0], 0.02 * np.sin(9.0 * theta[:, 1])
        return np.stack([along + across, across - along, theta[:, 1] - 0.02 * np.sin(9.0 * along)], axis=1)

    surface = ResponseSurface.of(Formula(NAMES, BOX, waves), (81, 81))
    assert list(surface.monotone.direction) == [0, 0, 1]
    alpha = np.array([[1.0, 0.05], [0.8, 0.05]])
    t = np.linspace(0.4, 1.3, 20001)
    first, second = (lambda x, i=i: CLIPPED[i].density(x, alpha[i]) for i in (0, 1))
    y = np.array([1.02, -0.93, 0.77])
    wave = 0.02 * np.sin(9.0 * t)
    exact = np.trapezoid(
        [second(t) * first(y[0] - wave), second(t) * first(wave - y[1]), first(t) * second(y[2] + wave)], t
    )
    density = PushForward(surface, CLIPPED, alpha)
    np.testing.assert_allclose(density.density(y), exact, rtol=1e-3)
    np.testing.assert_allclose(surface.at(y).log_density(CLIPPED, alpha[None])[0], np.log(exact), atol=1e-3)
    samples = waves(draw(CLIPPED, alpha, 200_000, np.random.default_rng(4)))
    np.testing.assert_allclose(density.cumulative(y), (samples <= y).mean(0), atol=0.005)


def test_one_parameter_follows_footnote_4() -> None:
    def example(theta: Array) -> Array:
        return np.tan(theta / 8.0) + np.exp(theta / 6.0 - 1.0) + np.tanh(theta / 2.0)

    family, alpha = ClippedNormal(-2.0, 5.0), np.array([[0.0, 2.0]])
    theta = np.linspace(-1.99, 4.9, 50)[:, None]
    slope = 0.125 / np.cos(theta / 8.0) ** 2 + np.exp(theta / 6.0 - 1.0) / 6.0
    slope += 0.5 / np.cosh(theta / 2.0) ** 2
    for sense in (1.0, -1.0):
        density = monotone_density(lambda t, s=sense: s * example(t), family, alpha)
        y = sense * example(theta)
        np.testing.assert_allclose(density.density(y), family.density(theta, alpha[0]) / slope, rtol=1e-3)
        below = family.cumulative(theta, alpha[0])
        np.testing.assert_allclose(density.cumulative(y), below if sense > 0.0 else 1.0 - below, atol=1e-5)
    assert np.all(density.log_density(np.array([[9.0], [-9.0]])) == -np.inf)


def test_a_response_that_turns_around_is_refused() -> None:
    def turning(theta: Array) -> Array:
        bowl = np.sum((theta - [1.0, 0.8]) ** 2, axis=1)
        return np.stack([theta[:, 0], bowl], axis=1)

    surface = ResponseSurface.of(Formula(NAMES, BOX, turning), (9, 9))
    with pytest.raises(BadInput, match=r"non-monotone response: output 2 of 2 .* theta_1 or theta_2"):
        surface.at(np.array([1.0, 0.02]))
    with pytest.raises(BadInput, match="non-monotone response"):
        PushForward(surface, CLIPPED, CLUTCH).log_density(np.array([1.0, 0.02]))


def test_constant_outputs_three_parameters_and_data_of_another_length_are_refused() -> None:
    constant = Formula(NAMES, BOX, lambda t: np.ones((len(t), 1)))
    with pytest.raises(BadInput, match="output 1 of 1"):
        ResponseSurface.of(constant, (5, 5)).at(np.ones(1))
    three = Formula(("a", "b", "c"), np.tile([0.0, 1.0], (3, 1)), lambda t: t.sum(1, keepdims=True))
    with pytest.raises(BadInput, match=r"one or two parameters, got 3 \(a, b, c\)"):
        ResponseSurface.of(three, (3, 3, 3)).at(np.ones(1))
    with pytest.raises(BadInput, match=r"one number for each of 3 outputs, got shape \(2,\)"):
        KINKED.at(np.ones(2))


def test_parameters_outside_the_bounds_are_refused() -> None:
    alpha = np.array([[0.91, 0.081], [0.55, 0.1]])
    unbounded = (CLIPPED[0], Gaussian())
    with pytest.raises(BadInput, match=r"theta_2 lies outside 0.4 to 1.15, .* with probability 0.067"):
        PushForward(KINKED, unbounded, alpha)
    with pytest.raises(BadInput, match="theta_2 lies outside"):
        KINKED.at(KINKED.spans.mean(1)).log_density(unbounded, alpha[None])
    alpha[0, 1] = -1.0
    with pytest.raises(BadInput, match="theta_1: sigma must be positive"):
        PushForward(KINKED, CLIPPED, alpha)


def test_a_batch_of_distributions_equals_its_members() -> None:
    generator = np.random.default_rng(5)
    alphas = generator.uniform([[0.8, 0.01], [0.5, 0.01]], [[1.2, 0.2], [1.0, 0.2]], (20, 2, 2))
    data = KINKED.at(np.diagonal(KINKED(draw(CLIPPED, CLUTCH, 3, generator))).copy())
    batch = data.log_density(CLIPPED, alphas)
    assert batch.shape == (20, 3)
    alone = np.concatenate([data.log_density(CLIPPED, alpha[None]) for alpha in alphas])
    np.testing.assert_array_equal(batch, alone)


def test_any_shape_of_values() -> None:
    exact = PushForward(KINKED, CLIPPED, CLUTCH)
    y = KINKED(draw(CLIPPED, CLUTCH, 40, np.random.default_rng(6)))
    for function in (exact.log_density, exact.cumulative):
        np.testing.assert_array_equal(function(y.reshape(2, 20, 3)), function(y).reshape(2, 20, 3))
        np.testing.assert_allclose(function(y[7]), function(y)[7], rtol=1e-12)


def test_a_surface_keeps_its_nodes_and_bilinear_functions() -> None:
    def bilinear(theta: Array) -> Array:
        return np.stack([theta[:, 0] + 2.0 * theta[:, 1], theta[:, 0] * theta[:, 1]], axis=1)

    theta = np.random.default_rng(7).uniform(*BOX.T, (500, 2))
    surface = ResponseSurface.of(Formula(NAMES, BOX, bilinear), (6, 5))
    np.testing.assert_allclose(surface(theta), bilinear(theta), rtol=1e-12)
    corners = np.array([[a, b] for a in BOX[0] for b in BOX[1]])
    np.testing.assert_allclose(KINKED(corners), kinked(corners), rtol=1e-12)
    assert surface(theta[:0]).shape == (0, 2)


def test_a_surface_of_three_parameters() -> None:
    bounds = np.array([[0.0, 1.0], [1.0, 2.0], [-1.0, 1.0]])

    def smooth(theta: Array) -> Array:
        return np.stack([np.exp(theta @ [0.5, 0.3, -0.4]), theta.prod(1)], axis=1)

    theta = np.random.default_rng(8).uniform(*bounds.T, (200, 3))
    surface = ResponseSurface.of(Formula(("a", "b", "c"), bounds, smooth), (9, 7, 11))
    np.testing.assert_allclose(surface(theta), smooth(theta), atol=1e-3)


def test_a_surface_rises_where_its_nodes_rise() -> None:
    line = np.linspace(0.7, 1.3, 500)
    for across in np.linspace(0.4, 1.15, 9):
        y = KINKED(np.stack([line, np.full_like(line, across)], axis=1))
        assert np.all(np.diff(y, axis=0) >= 0.0)


def test_errors_bound_those_of_the_surface_and_fall_with_the_nodes() -> None:
    theta = np.random.default_rng(9).uniform(*BOX.T, (5000, 2))
    actual = np.abs(KINKED(theta) - kinked(theta)).max(0)
    assert np.all(KINKED.errors.sum(0) > actual)
    finer = ResponseSurface.of(Formula(NAMES, BOX, kinked), (57, 9)).errors
    assert np.all(finer[0] < 0.5 * KINKED.errors[0])
    np.testing.assert_allclose(finer[1], KINKED.errors[1], rtol=0.5)


def test_a_surface_refuses_theta_outside_and_too_few_nodes() -> None:
    words = r"theta = \(1.31, 0.5\) lies outside the bounds of theta_1, 0.7 to 1.3"
    with pytest.raises(BadInput, match=words):
        KINKED(np.array([[1.0, 0.5], [1.31, 0.5]]))
    with pytest.raises(BadInput, match="at least 3 along every axis, got 2"):
        ResponseSurface.of(KINKED, (9, 2))
    with pytest.raises(BadInput, match="must be 2 numbers, one for each parameter, got 1"):
        ResponseSurface.of(KINKED, (9,))


FAMILIES: tuple[Family, ...] = (TruncatedNormal(0.7, 1.3), TruncatedNormal(0.4, 1.15))
ALPHA = np.array([[0.95, 0.06], [0.7, 0.05]])
SLOPES = np.array([[1.0, 0.5], [0.3, 0.8], [0.9, -0.4]])

LINEAR = Formula(NAMES, np.array([[-9.0, 9.0], [-9.0, 9.0]]), lambda theta: theta @ SLOPES.T)
CURVED = Formula(NAMES, BOX, lambda theta: np.exp(theta @ SLOPES.T) + theta[:, :1] ** 3)
SURFACE = ResponseSurface.of(CURVED, (25, 25))


def partly(theta: Array) -> Array:
    """The second of three outputs does not exist above 1.2."""
    y = theta @ SLOPES.T
    y[theta[:, 0] > 1.2, 1] = np.nan
    return y


def test_chaos_of_a_linear_response_is_exact() -> None:
    alpha = np.array([[0.4, 0.3], [0.1, 0.2]])
    density = ChaosGaussian(LINEAR, Chaos((Gaussian(), Gaussian()), 1, 2))(alpha)
    np.testing.assert_allclose(density.mean, SLOPES @ alpha[:, 0])
    np.testing.assert_allclose(density.std, np.sqrt(SLOPES**2 @ alpha[:, 1] ** 2))


@pytest.mark.parametrize(
    ("way", "error"),
    [
        (ChaosGaussian(CURVED, Chaos(FAMILIES, 4, 5)), 0.15),
        (ChaosMaximumEntropy(CURVED, Chaos(FAMILIES, 4, 5)), 0.01),
        (MonteCarlo(CURVED, FAMILIES, 200_000, seed=1), 0.05),
        (QuasiMonteCarlo(CURVED, FAMILIES, 200_000), 0.05),
        (lambda alpha: of_moments(MonteCarlo(CURVED, FAMILIES, 200_000, seed=1).outputs(alpha), 2), 0.15),
        (lambda alpha: of_moments(QuasiMonteCarlo(CURVED, FAMILIES, 200_000).outputs(alpha), 4), 0.01),
    ],
)
def test_every_way_leads_to_the_exact_densities(way: Propagation, error: float) -> None:
    exact, density = ExactPushForward(SURFACE, FAMILIES)(ALPHA), way(ALPHA)
    outputs = CURVED(draw(FAMILIES, ALPHA, 10_000, np.random.default_rng(2)))
    y = np.quantile(outputs, [0.1, 0.4, 0.5, 0.9], axis=0)
    np.testing.assert_allclose(density.log_density(y), exact.log_density(y), atol=error)
    np.testing.assert_allclose(density.cumulative(y), exact.cumulative(y), atol=error)


def test_two_moments_make_gaussians_and_more_make_maximum_entropy() -> None:
    sampler = QuasiMonteCarlo(CURVED, FAMILIES, 400)
    assert isinstance(of_moments(sampler.outputs(ALPHA), 2), GaussianDensity)
    assert isinstance(of_moments(sampler.outputs(ALPHA), 4), MaximumEntropy)


def test_monte_carlo_depends_on_its_seed_alone() -> None:
    y = CURVED(ALPHA[:, :1].T)
    first, again, other = (MonteCarlo(CURVED, FAMILIES, 500, k)(ALPHA).log_density(y) for k in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert np.all(first != other)


def test_moments_of_blocks_are_those_of_all_samples() -> None:
    y = np.random.default_rng(3).gamma([2.0, 5.0], [0.1, 3.0], (3000, 2))
    y[:, 0] += 100.0
    mean, std, moments = sample_moments(iter([y[:100], y[100:1000], y[1000:]]), 4)
    np.testing.assert_allclose(mean, y.mean(0))
    np.testing.assert_allclose(std, y.std(0))
    expected = [np.zeros(2), np.ones(2), skew(y), kurtosis(y, fisher=False)]
    np.testing.assert_allclose(moments, expected, rtol=1e-9, atol=1e-12)
    with pytest.raises(BadInput, match="moments must be at least 2, got 1"):
        sample_moments(iter([y]), 1)
    with pytest.raises(BadInput, match="samples of output 2 of 2 are all equal"):
        sample_moments(iter([y * [1.0, 0.0]]), 2)


@pytest.mark.parametrize(("asked", "made"), [(1, 1), (25, 25), (30, 25), (31, 36), (1009, 1024)])
def test_an_even_grid_is_even_in_probability(asked: int, made: int) -> None:
    theta = even_grid(FAMILIES, ALPHA, asked)
    assert theta.shape == (made, 2)
    for k, family in enumerate(FAMILIES):
        levels = np.unique(family.cumulative(theta[:, k], ALPHA[k]).round(9))
        m = round(made**0.5)
        np.testing.assert_allclose(levels, (np.arange(m) + 0.5) / m, atol=1e-8)


def test_draws_follow_their_families() -> None:
    theta = draw(FAMILIES, ALPHA, 100_000, np.random.default_rng(4))
    shares = np.stack([f.cumulative(t, a) for f, t, a in zip(FAMILIES, theta.T, ALPHA, strict=True)])
    levels = np.array([[0.1], [0.5], [0.9]])
    np.testing.assert_allclose(np.quantile(shares, levels[:, 0], axis=1), levels * [1, 1], atol=0.01)
    assert abs(np.corrcoef(shares)[0, 1]) < 0.02
    with pytest.raises(BadInput, match="samples must be at least 1, got 0"):
        draw(FAMILIES, ALPHA, 0, np.random.default_rng(4))
    with pytest.raises(BadInput, match="sigma must be positive"):
        draw(FAMILIES, -ALPHA, 1, np.random.default_rng(4))


def test_every_output_of_a_data_set_has_a_theta_of_its_own() -> None:
    same = Formula(NAMES, BOX, lambda theta: np.repeat(theta[:, :1], 3, axis=1))
    y = data_sets(same, FAMILIES, ALPHA, 3, 4000, np.random.default_rng(5))
    assert y.shape == (4000, 3)
    assert np.abs(np.corrcoef(y.T) - np.eye(3)).max() < 0.06
    np.testing.assert_allclose(y.mean(0), 0.95, atol=0.005)
    np.testing.assert_allclose(y.std(0), 0.06, atol=0.003)


def test_a_theta_without_the_event_is_refused() -> None:
    response = Formula(NAMES, BOX, partly)
    words = r"^the event does not happen at theta = \(1.25, 0.5\) for output 2 of 3: narrow the bounds$"
    with pytest.raises(BadInput, match=words):
        evaluate_response(response, np.array([[0.9, 0.5], [1.25, 0.5]]))
    with pytest.raises(BadInput, match="the event does not happen"):
        ResponseSurface.of(response, (5, 5))
    with pytest.raises(BadInput, match="the event does not happen"):
        MonteCarlo(response, FAMILIES, 100, seed=1)(np.array([[1.25, 0.05], [0.7, 0.05]]))


def test_a_theta_outside_the_bounds_is_refused() -> None:
    chaos = Chaos((Gaussian(), Gaussian()), 4, 5)
    words = r"lies outside the bounds of theta_1, 0\.7 to 1\.3: clip its distribution"
    with pytest.raises(BadInput, match=words):
        ChaosGaussian(CURVED, chaos)(np.array([[1.2, 0.1], [0.7, 0.01]]))


def test_the_floor_catches_impossible_data_and_counts_them() -> None:
    density = GaussianDensity(np.zeros(3), np.full(3, 0.1))
    floor = tail_floor(np.array([[-1.0, 1.0], [-1.0, 1.0], [-2.0, 2.0]]))
    np.testing.assert_allclose(floor, np.log([5e-5, 5e-5, 2.5e-5]))
    y = np.array([0.1, 3.0, np.nan])
    found = log_likelihoods(density, y, floor)
    np.testing.assert_allclose(found.each, [norm.logpdf(0.1, 0.0, 0.1), *floor[1:]])
    assert found.floored.tolist() == [False, True, True]
    np.testing.assert_allclose(found.total, found.each.sum())
    assert not log_likelihoods(density, y[:2] @ np.eye(2, 3)).floored.any()
    assert floored(np.array([-np.inf, 0.0]), -5.0).each.tolist() == [-5.0, 0.0]


def test_objectives_read_alpha_in_the_order_of_the_text() -> None:
    y = CURVED(ALPHA[:, :1].T)[0]
    data, chaos = SURFACE.at(y), ChaosMaximumEntropy(SURFACE, Chaos(FAMILIES, 4, 5))
    flat = np.array([ALPHA.T.ravel(), [1.0, 0.8, 0.1, 0.02]])
    floor = tail_floor(SURFACE.spans)
    exact = objective(lambda alphas: data.log_density(FAMILIES, alphas), floor)(flat)
    approximate = objective(at_data(chaos, y), floor)(flat)
    pairs = ALPHA, flat[1].reshape(2, 2).T
    alone = [ExactPushForward(SURFACE, FAMILIES)(a).log_density(y).sum() for a in pairs]
    np.testing.assert_allclose(exact, alone, atol=1e-3)
    np.testing.assert_allclose(approximate, alone, atol=0.05)


def test_clipped_and_truncated_normals_are_the_same_distribution() -> None:
    clipped = (ClippedNormal(0.7, 1.3), ClippedNormal(0.4, 1.15))
    y = SURFACE.spans.mean(1)
    wide = np.array([[0.75, 0.2], [1.0, 0.2]])
    one, other = (ExactPushForward(SURFACE, each)(wide).log_density(y) for each in (clipped, FAMILIES))
    np.testing.assert_allclose(one, other, rtol=1e-12)
