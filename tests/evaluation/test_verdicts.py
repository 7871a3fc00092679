"""What decides an order, a trend, equivalence: samples, and how many of them."""

import numpy as np
import pandas as pd
import pytest
from scipy.stats import mannwhitneyu

from pipeline.chapters import claims
from pipeline.chapters.verdicts import (
    DIRECTION,
    FAILS,
    HOLDS,
    TOO_FEW,
    alike_verdict,
    falling_verdict,
    order_verdict,
    worst,
)

GENERATOR = np.random.default_rng(0)
LOW, HIGH = GENERATOR.normal(0, 1, 10), GENERATOR.normal(5, 1, 10)


def test_an_order_of_independent_samples() -> None:
    assert order_verdict(HIGH, LOW) == HOLDS
    assert order_verdict(LOW, HIGH) == FAILS
    assert order_verdict(LOW + 0.1, LOW) == DIRECTION


@pytest.mark.parametrize(("larger", "smaller"), [(2, 2), (3, 3), (1, 4), (4, 1), (1, 1)])
def test_too_few_to_reach_the_level(larger: int, smaller: int) -> None:
    assert order_verdict(HIGH[:larger], LOW[:smaller]) == TOO_FEW
    # nor can the contrary be told
    assert order_verdict(LOW[:smaller], HIGH[:larger]) == TOO_FEW


@pytest.mark.parametrize(("larger", "smaller"), [(4, 3), (2, 10), (5, 1), (1, 5)])
def test_enough_to_reach_the_level(larger: int, smaller: int) -> None:
    assert order_verdict(HIGH[:larger], LOW[:smaller]) == HOLDS


def test_copies_of_a_deterministic_model_count_once() -> None:
    # a network is above the constant in eight of ten trainings, but not by as much as it is below in two
    networks = np.array([1.01] * 8 + [0.98] * 2) + np.arange(10) * 1e-4
    constant = 1.0
    assert mannwhitneyu(networks, np.full(10, constant), alternative="greater").pvalue < 0.01
    assert order_verdict(networks, np.full(10, constant)) == DIRECTION
    assert order_verdict(networks, np.full(10, constant)) == order_verdict(networks, np.array([constant]))
    # copies that differ by rounding
    rounded = constant * (1.0 + 1e-15 * np.arange(10))
    assert order_verdict(networks, rounded) == DIRECTION
    assert order_verdict(HIGH, np.full(10, LOW.max())) == HOLDS
    assert order_verdict(np.full(10, 2.0), np.full(10, 1.0)) == TOO_FEW


def test_pairs_are_compared_with_each_other() -> None:
    level = 10.0 * np.arange(5)
    assert order_verdict(level + 1.0 + 0.1 * np.arange(5), level, paired=True) == HOLDS
    assert order_verdict(level + 1.0, level) == DIRECTION
    assert order_verdict(level[:4] + 1.0, level[:4], paired=True) == TOO_FEW
    assert order_verdict(level, level, paired=True) == FAILS


def test_a_trend_is_tested_over_its_levels() -> None:
    levels = np.arange(5.0)
    assert falling_verdict(levels, -levels) == (HOLDS, pytest.approx(-1.0))
    assert falling_verdict(levels, np.array([5.0, 4.0, 3.0, 1.0, 2.0])) == (HOLDS, pytest.approx(-0.9))
    assert falling_verdict(levels, np.array([5.0, 3.0, 4.0, 1.0, 2.0])) == (DIRECTION, pytest.approx(-0.8))
    assert falling_verdict(levels, levels) == (FAILS, pytest.approx(1.0))
    assert falling_verdict(levels[:3], -levels[:3])[0] == TOO_FEW


def test_alike_is_shown_by_the_limits_not_by_the_values() -> None:
    close, wide = np.linspace(0.98, 1.02, 10), np.linspace(0.6, 2.0, 10)
    verdict, ratio, (low, high) = alike_verdict([close, 1.2 * close, 1.1 * close])
    assert verdict == HOLDS and ratio == pytest.approx(1.2) and low < ratio < high < 1.5
    # a ratio of 1.3, which another training may turn into 1.7
    verdict, ratio, (low, high) = alike_verdict([close, wide])
    assert verdict == DIRECTION and ratio < 1.5 < high
    assert alike_verdict([close, 1.6 * close])[0] == FAILS
    assert alike_verdict([close[:5], close[:5]])[0] == TOO_FEW


def test_a_claim_of_several_parts_is_as_good_as_the_worst() -> None:
    assert worst(HOLDS, DIRECTION) == DIRECTION
    assert worst(HOLDS, TOO_FEW, DIRECTION) == TOO_FEW
    assert worst(TOO_FEW, FAILS) == FAILS


def simulated(repeats: int, medians: dict[str, float]) -> pd.DataFrame:
    """Errors of eleven runs per fold: every model with its median and some scatter, `lls` with none."""
    scatter = 1.0 + 0.02 * GENERATOR.standard_normal(repeats)
    rows = [
        (split, fold, model, repeat, error * (1.0 if model == "lls" else scatter[repeat]) * (0.5 + 0.1 * run))
        for split, folds in (("interpolation", "abcde"), ("extrapolation", ["10%"]))
        for fold in folds
        for model, error in medians.items()
        for repeat in range(repeats)
        for run in range(11)
    ]
    return pd.DataFrame(rows, columns=["split", "fold", "model", "repeat", "omega_mse"])


def verdicts(rows: list[claims.Row]) -> dict[str, str]:
    return {row["id"]: row["verdict"] for row in rows}


MEDIANS = {"f_bb": 1.2, "f_h1": 1.1, "f_h2": 1.0, "lls": 5.0}


def test_claims_of_the_simulation() -> None:
    rows = claims.simulation(simulated(10, MEDIANS))
    assert set(verdicts(rows).values()) == {HOLDS}
    low, high = rows[0]["interval"]
    assert low < rows[0]["ours"] < high < 1.5
    found = verdicts(claims.simulation(simulated(10, {**MEDIANS, "f_bb": 1.49, "lls": 1.45})))
    assert found == {"interpolation_alike": DIRECTION, "extrapolation_hybrids": HOLDS, "linear_fails": FAILS}


def test_two_repeats_are_too_few_for_the_claims_of_the_simulation() -> None:
    assert set(verdicts(claims.simulation(simulated(2, MEDIANS))).values()) == {TOO_FEW}


def test_the_direct_extrapolation_is_one_number() -> None:
    def errors(repeats: int, direct: float) -> pd.DataFrame:
        offset = {"f_bb": 3.0, "f_h1": 2.0, "f_h2": 1.0, "motor": 0.5, "best": 0.5}
        rows = [(m, "10%", k, v + 0.01 * k) for m, v in offset.items() for k in range(repeats)]
        return pd.DataFrame([*rows, ("direct", "10%", 0, direct)], columns=["model", "fold", "repeat", "mae"])

    assert verdicts(claims.boundary(errors(10, 4.0))) == {"boundary_best_h2": HOLDS}
    assert verdicts(claims.boundary(errors(10, 1.045))) == {"boundary_best_h2": FAILS}
    assert verdicts(claims.boundary(errors(2, 4.0))) == {"boundary_best_h2": TOO_FEW}


@pytest.mark.parametrize(
    ("interval", "verdict"), [([0.96, 0.99], HOLDS), ([0.94, 0.99], DIRECTION), ([0.5, 0.99], FAILS)]
)
def test_the_lower_limit_decides_whether_the_force_separates(interval: list[float], verdict: str) -> None:
    metrics = {
        "contact": {"value": 60},
        "jump": {"value": 40},
        "f_dagger": {"accuracy": {"value": 0.97, "interval": interval, "n": 100}, "protocol": ""},
    }
    assert verdicts(claims.geometry_and_labels(metrics, (40, 40), "virtual"))["f_dagger_separates"] == verdict
