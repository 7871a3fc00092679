"""Profiles of one and of two parameters, on log-likelihoods whose shape is known."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq

from tests.uncertainty.log_likelihoods import (
    BOX,
    CENTRE,
    COUNT,
    COVARIANCE,
    MEAN,
    STD,
    UNIT_CUBE,
    gaussian,
    parabola,
    ridge,
    rough,
    two_hills,
)
from unmodelled.base.errors import BadInput
from unmodelled.uncertainty.identify import identify
from unmodelled.uncertainty.pair_profile import profile_pair
from unmodelled.uncertainty.profile import THRESHOLD, TOP, profile

Array = NDArray[np.float64]


def test_profiles_of_a_mean_and_a_standard_deviation() -> None:
    found = profile(gaussian, BOX, identify(gaussian, BOX).alpha)
    of_mean, of_std = found.curves
    np.testing.assert_allclose(
        of_mean.deviance, COUNT * np.log1p(((of_mean.values - MEAN) / STD) ** 2), atol=1e-3
    )
    ratio = STD / of_std.values
    np.testing.assert_allclose(of_std.deviance, COUNT * (ratio**2 - 1.0 - 2.0 * np.log(ratio)), atol=1e-3)
    half = STD * np.sqrt(np.expm1(THRESHOLD / COUNT))
    np.testing.assert_allclose(found.intervals[0], [MEAN - half, MEAN + half], rtol=1e-4)

    def excess(sigma: float) -> float:
        return COUNT * ((STD / sigma) ** 2 - 1.0 - 2.0 * np.log(STD / sigma)) - THRESHOLD

    ends = [brentq(excess, 0.5 * STD, STD), brentq(excess, STD, 2.0 * STD)]
    np.testing.assert_allclose(found.intervals[1], ends, rtol=1e-3)
    assert found.gain == 0.0


def test_profile_of_a_parabola_is_a_parabola() -> None:
    found = profile(rough(parabola), UNIT_CUBE, CENTRE)
    for k, curve in enumerate(found.curves):
        std = np.sqrt(COVARIANCE[k, k])
        np.testing.assert_allclose(curve.deviance, ((curve.values - CENTRE[k]) / std) ** 2, atol=2e-3)
        np.testing.assert_allclose(
            found.intervals[k], CENTRE[k] + 1.959964 * std * np.array([-1, 1]), atol=1e-4
        )
        assert np.all(np.diff(curve.values) > 0.0)
        assert curve.deviance[0] > TOP and curve.deviance[-1] > TOP
        # the others follow along the regression lines
        slope = COVARIANCE[:, k] / COVARIANCE[k, k]
        np.testing.assert_allclose(
            curve.alphas, CENTRE + np.outer(curve.values - CENTRE[k], slope), atol=1e-3
        )


def test_ridge_in_a_box_that_limits_it() -> None:
    """The sum is 1, so that the range of one parameter limits the other."""
    found = profile(ridge, np.array([[0.2, 0.8], [0.5, 0.6], [0.0, 1.0]]), np.array([0.45, 0.55, 0.5]))
    np.testing.assert_allclose(found.intervals[0], [0.4 - 0.0196, 0.5 + 0.0196], atol=5e-4)
    assert np.all(np.isinf(found.intervals[1:]))


def test_interval_is_open_only_where_a_bound_is_in_the_way() -> None:
    box = np.array([[MEAN - 0.2 * STD, 1.3], [0.005, 0.3]])
    curve = profile(gaussian, box, np.array([MEAN, STD])).curves[0]
    assert curve.low is None
    assert curve.values[0] == box[0, 0]
    assert curve.high == pytest.approx(MEAN + STD * np.sqrt(np.expm1(THRESHOLD / COUNT)), rel=1e-4)


def test_log_likelihood_that_ends_suddenly_ends_the_interval() -> None:
    def cut(alphas: Array) -> Array:
        return np.where(alphas[:, 0] > MEAN + 0.005, np.nan, gaussian(alphas))

    curve = profile(cut, BOX, np.array([MEAN, STD])).curves[0]
    assert curve.deviance[-1] == np.inf
    assert curve.high == pytest.approx(MEAN + 0.005, abs=2e-3 * np.ptp(BOX[0]))
    assert curve.low == pytest.approx(MEAN - STD * np.sqrt(np.expm1(THRESHOLD / COUNT)), rel=1e-4)


def test_cliff_behind_a_plain_is_located() -> None:
    def plain(alphas: Array) -> Array:
        return np.where(alphas[:, 0] > 0.537, -100.0, 0.0) - 0.5 * ((alphas[:, 1] - 0.5) / 0.1) ** 2

    curve = profile(plain, UNIT_CUBE[:2], np.array([0.2, 0.5])).curves[0]
    assert curve.high == pytest.approx(0.537, abs=2e-3)
    assert curve.low is None


def test_profile_changes_to_the_higher_branch() -> None:
    """Far from the optimum another y is the best; the way back finds it where the way out did not."""

    def branches(alphas: Array) -> Array:
        x, y = alphas.T
        near = -0.5 * ((x - 0.3) / 0.1) ** 2 - 0.5 * ((y - 0.2) / 0.08) ** 2
        far = -0.5 - 0.5 * ((x - 0.7) / 0.2) ** 2 - 0.5 * ((y - 0.8) / 0.25) ** 2
        return np.logaddexp(near, far)

    curve = profile(branches, UNIT_CUBE[:2], np.array([0.3, 0.2])).curves[0]
    y = np.linspace(0.0, 1.0, 2001)
    exact = [branches(np.column_stack([np.full_like(y, x), y])).max() for x in curve.values]
    np.testing.assert_allclose(curve.log_likelihood, exact, atol=2e-3)
    assert curve.alphas[-1, 1] > curve.alphas[0, 1] + 0.5


def test_progress_is_shown_where_the_work_has_a_name(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("EXP_PROGRESS", "verbose")
    monkeypatch.setattr("unmodelled.base.progress.OFTEN", 0.0)
    profile(parabola, UNIT_CUBE, CENTRE, "profiling")
    assert "profiling: 3/3" in capsys.readouterr().err
    profile_pair(parabola, UNIT_CUBE, CENTRE, (0, 1), CENTRE[:1], CENTRE[1:], "drawing contours")
    assert "drawing contours: 2/2" in capsys.readouterr().err


def test_optimum_without_a_log_likelihood_is_refused() -> None:
    def nowhere(alphas: Array) -> Array:
        return np.full(len(alphas), np.nan)

    message = r"at the given optimum \(0.5, 0.45, 0.6\) is not finite"
    with pytest.raises(BadInput, match=message):
        profile(nowhere, UNIT_CUBE, CENTRE)
    with pytest.raises(BadInput, match=message):
        profile_pair(nowhere, UNIT_CUBE, CENTRE, (0, 1), CENTRE, CENTRE)


def test_pair_profile_of_a_parabola() -> None:
    first, second = np.linspace(0.4, 0.6, 5), np.linspace(0.5, 0.7, 6)
    found = profile_pair(parabola, UNIT_CUBE, CENTRE, (0, 2), first, second)
    away = np.stack(np.meshgrid(first - CENTRE[0], second - CENTRE[2], indexing="ij"), -1)
    inverse = np.linalg.inv(COVARIANCE[np.ix_([0, 2], [0, 2])])
    np.testing.assert_allclose(found.deviance, np.einsum("pqi,ij,pqj->pq", away, inverse, away), atol=2e-3)
    np.testing.assert_array_equal(found.alphas[..., 0], np.broadcast_to(first[:, None], (5, 6)))
    np.testing.assert_array_equal(found.alphas[..., 2], np.broadcast_to(second, (5, 6)))
    assert found.gain == 0.0


def test_pair_profile_follows_a_valley_between_others() -> None:
    """A climb from the optimum itself would end on a ripple far from the main valley y = x."""

    def ripples(alphas: Array) -> Array:
        x, y, z = alphas.T
        away = y - x
        return 4.0 * np.cos(10.0 * np.pi * away) - 20.0 * away**2 - 0.5 * ((x - 0.5) / 0.1) ** 2 - z**2

    grid = np.linspace(0.3, 0.7, 21)
    found = profile_pair(ripples, UNIT_CUBE, np.array([0.5, 0.5, 0.0]), (0, 2), grid, np.zeros(1))
    np.testing.assert_allclose(found.deviance[:, 0], ((grid - 0.5) / 0.1) ** 2, atol=1e-3)


def test_pair_profile_takes_a_better_optimum() -> None:
    box, grid = np.array([[0.0, 1.0], [0.0, 1.0]]), np.linspace(0.1, 0.9, 9)
    found = profile_pair(two_hills, box, np.array([0.3, 0.5]), (0, 1), grid, grid)
    assert found.alpha[0] == pytest.approx(0.7, abs=1e-3)
    assert found.gain == pytest.approx(np.log(3.0), abs=0.01)
    reference = two_hills(found.alpha[None])[0]
    points = found.alphas.reshape(-1, 2)
    np.testing.assert_allclose(found.deviance.ravel(), 2.0 * (reference - two_hills(points)), atol=1e-9)
