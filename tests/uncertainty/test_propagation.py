"""From alpha to densities by every way; samples, data sets and log-likelihoods."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import kurtosis, norm, skew

from unmodelled.base.errors import BadInput
from unmodelled.uncertainty.chaos import Chaos
from unmodelled.uncertainty.density import GaussianDensity
from unmodelled.uncertainty.families import ClippedNormal, Family, Gaussian, TruncatedNormal
from unmodelled.uncertainty.likelihood import at_data, floored, log_likelihoods, objective, tail_floor
from unmodelled.uncertainty.maximum_entropy import MaximumEntropy
from unmodelled.uncertainty.propagation import (
    ChaosGaussian,
    ChaosMaximumEntropy,
    ExactPushForward,
    MonteCarlo,
    Propagation,
    QuasiMonteCarlo,
    of_moments,
    sample_moments,
)
from unmodelled.uncertainty.response import Formula, evaluate_response
from unmodelled.uncertainty.sampling import data_sets, draw, even_grid
from unmodelled.uncertainty.surface import ResponseSurface

Array = NDArray[np.float64]
NAMES = ("theta_1", "theta_2")
BOX = np.array([[0.7, 1.3], [0.4, 1.15]])
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
        (ChaosMaximumEntropy(CURVED, Chaos(FAMILIES, 4, 5), support=SURFACE.spans), 0.01),
        (MonteCarlo(CURVED, FAMILIES, 200_000, seed=1), 0.05),
        (QuasiMonteCarlo(CURVED, FAMILIES, 200_000), 0.05),
        (lambda alpha: of_moments(MonteCarlo(CURVED, FAMILIES, 200_000, seed=1).outputs(alpha), 2), 0.15),
        (lambda alpha: of_moments(QuasiMonteCarlo(CURVED, FAMILIES, 200_000).outputs(alpha), 4), 0.01),
    ],
)
def test_every_way_leads_to_the_exact_densities(way: Propagation, error: float) -> None:
    exact, density = ExactPushForward(SURFACE, FAMILIES)(ALPHA), way(ALPHA)
    y = np.quantile(
        CURVED(draw(FAMILIES, ALPHA, 10_000, np.random.default_rng(2))), [0.1, 0.4, 0.5, 0.9], axis=0
    )
    np.testing.assert_allclose(density.log_density(y), exact.log_density(y), atol=error)
    np.testing.assert_allclose(density.cumulative(y), exact.cumulative(y), atol=error)


def test_two_moments_make_gaussians_and_more_make_maximum_entropy() -> None:
    sampler = QuasiMonteCarlo(CURVED, FAMILIES, 400)
    assert isinstance(of_moments(sampler.outputs(ALPHA), 2), GaussianDensity)
    assert isinstance(of_moments(sampler.outputs(ALPHA), 4), MaximumEntropy)


def test_monte_carlo_depends_on_its_seed_alone() -> None:
    y = CURVED(ALPHA[:, :1].T)
    first, again, other = (
        MonteCarlo(CURVED, FAMILIES, 500, seed)(ALPHA).log_density(y) for seed in (1, 1, 2)
    )
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
    np.testing.assert_allclose(
        np.quantile(shares, [0.1, 0.5, 0.9], axis=1).T, [[0.1, 0.5, 0.9]] * 2, atol=0.01
    )
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
    with pytest.raises(
        BadInput,
        match=r"^the event does not happen at theta = \(1.25, 0.5\) for output 2 of 3: narrow the bounds$",
    ):
        evaluate_response(response, np.array([[0.9, 0.5], [1.25, 0.5]]))
    with pytest.raises(BadInput, match="the event does not happen"):
        ResponseSurface.of(response, (5, 5))
    with pytest.raises(BadInput, match="the event does not happen"):
        MonteCarlo(response, FAMILIES, 100, seed=1)(np.array([[1.25, 0.05], [0.7, 0.05]]))


def test_a_theta_outside_the_bounds_is_refused() -> None:
    chaos = Chaos((Gaussian(), Gaussian()), 4, 5)
    with pytest.raises(
        BadInput, match=r"lies outside the bounds of theta_1, 0\.7 to 1\.3: clip its distribution"
    ):
        ChaosGaussian(CURVED, chaos)(np.array([[1.2, 0.1], [0.7, 0.01]]))


def test_the_floor_catches_impossible_data_and_counts_them() -> None:
    density = GaussianDensity(np.zeros(3), np.full(3, 0.1))
    floor = tail_floor(np.array([[-1.0, 1.0], [-1.0, 1.0], [-2.0, 2.0]]))
    np.testing.assert_allclose(floor, np.log([5e-5, 5e-5, 2.5e-5]))
    y = np.array([0.1, 3.0, np.nan])
    found = log_likelihoods(density, y, floor)
    np.testing.assert_allclose(found.each, [norm.logpdf(0.1, 0.0, 0.1), *floor[1:]])
    assert found.hits == 2
    np.testing.assert_allclose(found.total, found.each.sum())
    assert log_likelihoods(density, y[:2] @ np.eye(2, 3)).hits == 0
    assert floored(np.array([-np.inf, 0.0]), -5.0).each.tolist() == [-5.0, 0.0]


def test_objectives_read_alpha_in_the_order_of_the_text() -> None:
    y = CURVED(ALPHA[:, :1].T)[0]
    data, chaos = SURFACE.at(y), ChaosMaximumEntropy(SURFACE, Chaos(FAMILIES, 4, 5))
    flat = np.array([ALPHA.T.ravel(), [1.0, 0.8, 0.1, 0.02]])
    floor = tail_floor(SURFACE.spans)
    exact = objective(lambda alphas: data.log_density(FAMILIES, alphas), floor)(flat)
    approximate = objective(at_data(chaos, y), floor)(flat)
    alone = [
        ExactPushForward(SURFACE, FAMILIES)(a).log_density(y).sum() for a in (ALPHA, flat[1].reshape(2, 2).T)
    ]
    np.testing.assert_allclose(exact, alone, atol=1e-3)
    np.testing.assert_allclose(approximate, alone, atol=0.05)


def test_clipped_and_truncated_normals_are_the_same_distribution() -> None:
    clipped = (ClippedNormal(0.7, 1.3), ClippedNormal(0.4, 1.15))
    y = SURFACE.spans.mean(1)
    wide = np.array([[0.75, 0.2], [1.0, 0.2]])
    one, other = (
        ExactPushForward(SURFACE, families)(wide).log_density(y) for families in (clipped, FAMILIES)
    )
    np.testing.assert_allclose(one, other, rtol=1e-12)
