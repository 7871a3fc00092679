"""The curvature of log-likelihoods whose shape is known, and what is told of it and of profiles."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
import pytest
from numpy.typing import NDArray

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
from unmodelled.uncertainty.advice import advice
from unmodelled.uncertainty.ascent import Objective
from unmodelled.uncertainty.curvature import curvature
from unmodelled.uncertainty.identify import identify
from unmodelled.uncertainty.profile import profile

Array = NDArray[np.float64]


def test_ridge_is_open_and_correlated() -> None:
    box = np.array([[0.2, 0.8], [0.2, 0.8], [0.0, 1.0]])
    start = identify(ridge, box).alpha
    found, bend = profile(rough(ridge), box, start), curvature(rough(ridge), box, start)
    assert np.all(np.isinf(found.intervals))
    for curve in found.curves:
        assert curve.low is None and curve.high is None
        assert curve.deviance.max() < 0.01
        np.testing.assert_allclose(curve.values[[0, -1]], curve.bounds)
    assert bend.singular and len(bend.flat) == 2
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
    box = np.array([[0.0, 1.0], [0.0, 1.0]])
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
    assert bend.std[1] == 0.0 and not bend.singular
    assert not any("hard to tell apart" in line for line in advice(["a", "b", "c"], found, bend))


def test_curvature_of_a_mean_and_a_standard_deviation() -> None:
    bend = curvature(rough(gaussian), BOX, np.array([MEAN, STD]))
    np.testing.assert_allclose(np.diag(bend.hessian), [COUNT / STD**2, 2.0 * COUNT / STD**2], rtol=5e-3)
    np.testing.assert_allclose(bend.std, STD / np.sqrt([COUNT, 2.0 * COUNT]), rtol=5e-3)
    assert abs(bend.correlation[0, 1]) < 1e-3
    assert not bend.singular


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
    words = re.fullmatch(
        "sigma = 0.03 is known only in its order of magnitude: 95 % interval (.*) to (.*)", said[0]
    )
    assert words and len(said) == 1
    expected = 0.03 * np.exp(0.4 * 1.95996 * np.array([-1.0, 1.0]))
    np.testing.assert_allclose([float(w) for w in words.groups()], expected, rtol=5e-3)
