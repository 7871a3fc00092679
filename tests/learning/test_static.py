"""Static models find what made the samples, and networks minimise Eq. 2.6."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline.cam_follower.static import efficiency, fit_motor, fit_network

Array = NDArray[np.float64]
U: Array = np.linspace(4.0, 15.0, 16)


def samples(noise: float = 0.0) -> Array:
    return efficiency(U, 200.0, 5.0, 0.006) + noise * np.random.default_rng(0).standard_normal(len(U))


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def test_the_parameters_that_made_the_samples_are_found() -> None:
    assert fit_motor(U, samples(), 200.0) == pytest.approx((5.0, 0.006), rel=1e-6)


def test_no_other_parameters_fit_noisy_samples_better() -> None:
    y = samples(0.01)
    resistance, friction = fit_motor(U, y, 200.0)
    best = rms(efficiency(U, 200.0, resistance, friction) - y)
    for factor in (0.99, 1.01):
        assert rms(efficiency(U, 200.0, factor * resistance, friction) - y) > best
        assert rms(efficiency(U, 200.0, resistance, factor * friction) - y) > best


def test_more_neurons_come_closer_to_the_samples_and_a_penalty_holds_them_back() -> None:
    y = samples(0.01)
    errors = [rms(fit_network(U, y, hidden, 0.0, 0)(U) - y) for hidden in (1, 3, 64)]
    assert errors[0] > errors[1] > 5.0 * errors[2]
    held = [rms(fit_network(U, y, 64, penalty, 0)(U) - y) for penalty in (0.1, 1.0, 10.0)]
    assert errors[2] < held[0] < held[1] < held[2]


def test_the_loss_is_a_mean_over_samples_and_weights() -> None:
    """Eq. 2.6 does not change if every sample is there twice, nor then its minimum."""
    y = samples(0.01)
    once = fit_network(U, y, 4, 1.0, 0)(U)
    twice = fit_network(np.tile(U, 2), np.tile(y, 2), 4, 1.0, 0)(U)
    np.testing.assert_allclose(once, twice, atol=1e-5)
    assert np.ptp(once - y) > 1e-3


def test_the_units_of_the_samples_do_not_matter() -> None:
    y = samples(0.01)
    plain, scaled = fit_network(U, y, 4, 1.0, 0), fit_network(1e3 * U, 100.0 * y + 7.0, 4, 1.0, 0)
    np.testing.assert_allclose(scaled(1e3 * U), 100.0 * plain(U) + 7.0, rtol=1e-6)


def test_a_seed_decides() -> None:
    y = samples(0.01)
    first, same, other = (fit_network(U, y, 16, 0.0, seed)(U + 8.0) for seed in (0, 0, 1))
    np.testing.assert_array_equal(first, same)
    assert np.abs(first - other).max() > 1e-3
