"""Profiles of one and of two parameters, curvature and advice, on log-likelihoods whose shape is known."""

import re
from collections.abc import Sequence

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.uncertainty.test_identify import BOX, SAMPLE, Array, gaussian
from unmodelled.base.errors import BadInput
from unmodelled.uncertainty.advice import advice
from unmodelled.uncertainty.ascent import Objective
from unmodelled.uncertainty.curvature import curvature
from unmodelled.uncertainty.identify import identify
from unmodelled.uncertainty.profile import THRESHOLD, TOP, profile, profile_pair

COUNT = len(SAMPLE)
MEAN, STD = float(SAMPLE.mean()), float(SAMPLE.std())
UNIT_CUBE = np.array([[0.0, 1.0]] * 3)
COVARIANCE = np.array([[4.0, -2.4, 0.5], [-2.4, 2.5, 0.3], [0.5, 0.3, 1.0]]) * 1e-3
CENTRE = np.array([0.5, 0.45, 0.6])


def parabola(alphas: Array) -> Array:
    """Log-likelihood of a normal distribution around `CENTRE`."""
    away = alphas - CENTRE
    return -0.5 * np.einsum("bi,ij,bj->b", away, np.linalg.inv(COVARIANCE), away)


def ridge(alphas: Array) -> Array:
    """The first two parameters enter by their sum only; the last has no effect."""
    return -0.5 * ((alphas[:, 0] + alphas[:, 1] - 1.0) / 0.01) ** 2


def rough(objective: Objective) -> Objective:
    """The same with a ripple of 1e-6 that is finer than any step."""
    return lambda alphas: objective(alphas) + 1e-6 * np.sin(1e7 * alphas.sum(1))


def two_hills(alphas: Array) -> Array:
    """A lower maximum at 0.3, a shallow valley, a higher maximum at 0.7; the second parameter is plain."""
    x, y = alphas.T
    hills = np.exp(-0.5 * ((x - 0.3) / 0.1) ** 2) + 3.0 * np.exp(-0.5 * ((x - 0.7) / 0.1) ** 2)
    return np.log(hills) - 0.5 * ((y - 0.5) / 0.05) ** 2


def test_profiles_of_a_mean_and_a_standard_deviation() -> None:
    found = profile(gaussian, BOX, identify(gaussian, BOX).alpha)
    of_mean, of_std = found.curves
    away = (of_mean.values - MEAN) / STD
    np.testing.assert_allclose(of_mean.deviance, COUNT * np.log1p(away**2), atol=1e-3)
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
        ends = CENTRE[k] + 1.959964 * std * np.array([-1, 1])
        np.testing.assert_allclose(found.intervals[k], ends, atol=1e-4)
        assert np.all(np.diff(curve.values) > 0.0)
        assert curve.deviance[0] > TOP and curve.deviance[-1] > TOP
        # the others follow along the regression lines
        line = CENTRE + np.outer(curve.values - CENTRE[k], COVARIANCE[:, k] / COVARIANCE[k, k])
        np.testing.assert_allclose(curve.alphas, line, atol=1e-3)


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
    identify(gaussian, BOX)
    assert capsys.readouterr().err == ""
    identify(gaussian, BOX, description="identifying")
    assert "identifying: 1/300" in capsys.readouterr().err
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


def test_ridge_is_open_and_correlated() -> None:
    box = np.array([[0.2, 0.8], [0.2, 0.8], [0.0, 1.0]])
    start = identify(ridge, box).alpha
    found, bend = profile(rough(ridge), box, start), curvature(rough(ridge), box, start)
    assert np.all(np.isinf(found.intervals))
    for curve in found.curves:
        assert curve.low is None and curve.high is None
        assert curve.deviance.max() < 0.01
        np.testing.assert_allclose(curve.values[[0, -1]], curve.bounds)
    assert len(bend.flat) == 2
    assert bend.correlation[0, 1] == pytest.approx(-1.0, abs=2e-3)
    assert abs(bend.correlation[0, 2]) < 0.05
    assert np.all(bend.std > 0.1)
    said = "\n".join(advice(["a", "b", "c"], found, bend))
    for name in "abc":
        assert f"{name} cannot be identified: the data allow all of its bounds" in said
    assert "a and b are hard to tell apart: their estimates are correlated (-1.00)" in said
    assert "a and b can change together without changing the log-likelihood" in said
    assert "c does not change the log-likelihood at the optimum: hold it fixed" in said


def test_optimum_on_a_bound() -> None:
    box = np.array([[1.0, 1.3], [0.005, 0.3]])
    best = identify(gaussian, box).alpha
    found = profile(gaussian, box, best)
    assert found.curves[0].low is None and found.curves[0].high is not None
    bend = curvature(gaussian, box, best)
    np.testing.assert_allclose(np.diag(bend.hessian)[0], COUNT / best[1] ** 2, rtol=1e-2)
    said = advice(["mu", "sigma"], found, bend)
    assert "mu lies on its lower bound 1: widen the bounds or hold it fixed" in said
    assert any(line.startswith("mu = 1 has no lower limit") for line in said)
    assert any(line.startswith("sigma = 0.1") and "is identified: 95 % interval" in line for line in said)


def test_better_optimum_is_taken_and_told() -> None:
    box = UNIT_CUBE[:2]
    found = profile(two_hills, box, np.array([0.3, 0.5]))
    assert found.alpha[0] == pytest.approx(0.7, abs=1e-3)
    assert found.gain == pytest.approx(np.log(3.0), abs=0.01)
    assert all(c.deviance.min() == 0.0 for c in found.curves)
    said = advice(["x", "y"], found, curvature(two_hills, box, found.alpha))
    assert said[0] == "the profiles found a better optimum: its log-likelihood is higher by 1.1"
    assert not any("better optimum" in line for line in advice_at(two_hills, box, found.alpha, "xy"))


def advice_at(objective: Objective, box: Array, alpha: Array, names: Sequence[str]) -> list[str]:
    return advice(names, profile(objective, box, alpha), curvature(objective, box, alpha))


def test_held_parameter_has_no_profile() -> None:
    box = np.array([[0.0, 1.0], [0.45, 0.45], [0.0, 1.0]])
    found = profile(parabola, box, CENTRE)
    assert [c.index for c in found.curves] == [0, 2]
    assert found.intervals[1].tolist() == [0.45, 0.45]
    bend = curvature(parabola, box, CENTRE)
    inverse = np.linalg.inv(np.linalg.inv(COVARIANCE)[np.ix_([0, 2], [0, 2])])
    np.testing.assert_allclose(bend.covariance[np.ix_([0, 2], [0, 2])], inverse, rtol=1e-3)
    assert bend.std[1] == 0.0 and not len(bend.flat)
    assert not any("hard to tell apart" in line for line in advice(["a", "b", "c"], found, bend))


def test_curvature_of_a_mean_and_a_standard_deviation() -> None:
    bend = curvature(rough(gaussian), BOX, np.array([MEAN, STD]))
    np.testing.assert_allclose(np.diag(bend.hessian), [COUNT / STD**2, 2.0 * COUNT / STD**2], rtol=5e-3)
    np.testing.assert_allclose(bend.std, STD / np.sqrt([COUNT, 2.0 * COUNT]), rtol=5e-3)
    assert abs(bend.correlation[0, 1]) < 1e-3
    assert not len(bend.flat)


def test_curvature_of_correlated_parameters() -> None:
    bend = curvature(rough(parabola), UNIT_CUBE, CENTRE)
    np.testing.assert_allclose(bend.covariance, COVARIANCE, atol=2e-6)
    scale = np.sqrt(np.diag(COVARIANCE))
    np.testing.assert_allclose(bend.correlation, COVARIANCE / np.outer(scale, scale), atol=1e-3)


def test_strong_correlation_is_told() -> None:
    def narrow(alphas: Array) -> Array:
        u, v = (alphas[:, 0] + alphas[:, 1] - 1.0) / 0.01, (alphas[:, 0] - alphas[:, 1]) / 0.1
        return -0.5 * (u**2 + v**2)

    said = advice_at(narrow, UNIT_CUBE[:2], np.array([0.5, 0.5]), ["mu_1", "mu_2"])
    assert "mu_1 and mu_2 are hard to tell apart: their estimates are correlated (-0.98)" in said


def test_order_of_magnitude_is_told_from_a_sharp_interval() -> None:
    def objective(alphas: Array) -> Array:
        return -0.5 * (np.log(alphas[:, 0] / 0.03) / 0.4) ** 2

    said = advice_at(objective, np.array([[0.001, 1.0]]), np.array([0.03]), ["sigma"])
    known = "sigma = 0.03 is known only in its order of magnitude: 95 % interval (.*) to (.*)"
    words = re.fullmatch(known, said[0])
    assert words and len(said) == 1
    expected = 0.03 * np.exp(0.4 * 1.95996 * np.array([-1.0, 1.0]))
    np.testing.assert_allclose([float(w) for w in words.groups()], expected, rtol=5e-3)
