"""The exact densities of monotone responses, against closed forms, slow quadrature and Monte Carlo."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import lognorm

from unmodelled.base.errors import BadInput
from unmodelled.uncertainty.families import ClippedNormal, Gaussian, Uniform
from unmodelled.uncertainty.propagation import MonteCarlo
from unmodelled.uncertainty.push_forward import PushForward, monotone_density
from unmodelled.uncertainty.response import Formula
from unmodelled.uncertainty.sampling import draw
from unmodelled.uncertainty.surface import ResponseSurface

Array = NDArray[np.float64]
NAMES = ("theta_1", "theta_2")
BOX = np.array([[0.7, 1.3], [0.4, 1.15]])
CLIPPED = (ClippedNormal(0.7, 1.3), ClippedNormal(0.4, 1.15))
ALPHA = np.array([[0.91, 0.081], [0.55, 0.046]])


def kinked(theta: Array) -> Array:
    """Three outputs whose slopes jump along lines across the box; the last falls along the second axis."""
    x, y = theta.T
    return np.stack(
        [
            0.5 * x + 0.2 * y + np.maximum(0.0, x + 0.6 * y - 1.3),
            0.5 * x + 0.2 * y**2 + 2.0 * np.maximum(0.0, x + 0.3 * y - 1.1),
            0.4 * x**2 - 0.3 * y + np.maximum(0.0, x - 0.6 * y - 0.5),
        ],
        axis=1,
    )


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


def test_it_agrees_with_monte_carlo() -> None:
    exact = PushForward(KINKED, CLIPPED, ALPHA)
    samples = KINKED(draw(CLIPPED, ALPHA, 200_000, np.random.default_rng(2)))
    y = np.quantile(samples, [0.01, 0.1, 0.5, 0.9, 0.99], axis=0)
    shares = np.stack([(samples <= row).mean(0) for row in y])
    np.testing.assert_allclose(exact.cumulative(y), shares, atol=0.005)
    histogram = MonteCarlo(KINKED, CLIPPED, 200_000, seed=3)(ALPHA)
    np.testing.assert_allclose(exact.log_density(y), histogram.log_density(y), atol=0.15)


def test_cumulative_probability_is_the_integral_of_the_density() -> None:
    exact = PushForward(KINKED, CLIPPED, ALPHA)
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
    slope = (
        0.125 / np.cos(theta / 8.0) ** 2 + np.exp(theta / 6.0 - 1.0) / 6.0 + 0.5 / np.cosh(theta / 2.0) ** 2
    )
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
        PushForward(surface, CLIPPED, ALPHA).log_density(np.array([1.0, 0.02]))


def test_a_constant_output_is_refused() -> None:
    surface = ResponseSurface.of(Formula(NAMES, BOX, lambda t: np.ones((len(t), 1))), (5, 5))
    with pytest.raises(BadInput, match="output 1 of 1"):
        surface.at(np.ones(1))


def test_three_parameters_are_refused() -> None:
    bounds = np.tile([0.0, 1.0], (3, 1))
    surface = ResponseSurface.of(
        Formula(("a", "b", "c"), bounds, lambda t: t.sum(1, keepdims=True)), (3, 3, 3)
    )
    with pytest.raises(BadInput, match=r"one or two parameters, got 3 \(a, b, c\)"):
        surface.at(np.ones(1))


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


def test_data_of_another_length_are_refused() -> None:
    with pytest.raises(BadInput, match=r"one number for each of 3 outputs, got shape \(2,\)"):
        KINKED.at(np.ones(2))


def test_a_batch_of_distributions_equals_its_members() -> None:
    generator = np.random.default_rng(5)
    alphas = np.stack(
        [generator.uniform([[0.8, 0.01], [0.5, 0.01]], [[1.2, 0.2], [1.0, 0.2]]) for _ in range(20)]
    )
    data = KINKED.at(np.diagonal(KINKED(draw(CLIPPED, ALPHA, 3, generator))).copy())
    batch = data.log_density(CLIPPED, alphas)
    assert batch.shape == (20, 3)
    alone = np.concatenate([data.log_density(CLIPPED, alpha[None]) for alpha in alphas])
    np.testing.assert_array_equal(batch, alone)


def test_any_shape_of_values() -> None:
    exact = PushForward(KINKED, CLIPPED, ALPHA)
    y = KINKED(draw(CLIPPED, ALPHA, 40, np.random.default_rng(6)))
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
    with pytest.raises(
        BadInput, match=r"theta = \(1.31, 0.5\) lies outside the bounds of theta_1, 0.7 to 1.3"
    ):
        KINKED(np.array([[1.0, 0.5], [1.31, 0.5]]))
    with pytest.raises(BadInput, match="at least 3 along every axis, got 2"):
        ResponseSurface.of(KINKED, (9, 2))
    with pytest.raises(BadInput, match="must be 2 numbers, one for each parameter, got 1"):
        ResponseSurface.of(KINKED, (9,))
