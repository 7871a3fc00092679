"""Residuals of windows are of a t distribution: few windows that nothing predicts decide nothing."""

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from unmodelled.diagnosis.judge.tails import log_densities, scale, shares


def squares(seed: int, windows: int = 40, samples: float = 6.0) -> tuple[np.ndarray, np.ndarray]:
    each = np.full((windows, 2), samples)
    return np.random.default_rng(seed).chisquare(each), each


@pytest.mark.parametrize("seed", range(5))
def test_the_scale_is_the_likeliest(seed: int) -> None:
    found, each = squares(seed)
    found[:3] *= 1e4
    best = scale(found, each)
    for j in range(2):
        column = slice(j, j + 1)

        def lost(log: float, column: slice = column) -> float:
            return -float(log_densities(found[:, column], each[:, column], np.exp([log])).sum())

        wanted = minimize_scalar(lost, (np.log(best[j]) - 1.0, np.log(best[j]) + 1.0)).x
        assert np.log(best[j]) == pytest.approx(wanted, abs=0.02)


def test_windows_that_nothing_predicts_do_not_hide_what_a_law_does_in_the_others() -> None:
    found, each = squares(0)
    without = 9.0 * found
    found[:2] = without[:2] = 1e5
    gained = [float(log_densities(s, each, scale(s, each)).sum()) for s in (without, found)]
    # 38 windows of 6 samples that are nine times smaller: log(9) / 2 each, of which two windows cost a little
    assert gained[1] - gained[0] > 0.9 * 38 * 6.0 * np.log(9.0)
    assert (shares(found, each, scale(found, each))[:2] < 1e-3).all()


def test_a_law_of_few_windows_has_evidence() -> None:
    found, each = squares(1)
    rare = found.copy()
    rare[:2] *= 1e3
    gained = [float(log_densities(s, each, scale(s, each)).sum()) for s in (rare, found)]
    assert gained[1] - gained[0] > 40.0


def test_a_window_without_samples_counts_for_nothing() -> None:
    found, each = squares(2)
    more = np.concatenate([found, np.zeros((1, 2))]), np.concatenate([each, np.zeros((1, 2))])
    assert scale(*more) == pytest.approx(scale(found, each))
    assert log_densities(*more, np.ones(2)).sum() == pytest.approx(
        log_densities(found, each, np.ones(2)).sum()
    )


@pytest.mark.filterwarnings("error")
def test_an_output_that_no_window_has_changes_no_other() -> None:
    squares, samples = np.array([[1.0, 0.0], [4.0, 0.0]]), np.array([[2.0, 0.0], [2.0, 0.0]])
    both = scale(squares, samples)
    assert both[0] == scale(squares[:, :1], samples[:, :1])[0]
    assert np.all(np.isfinite(log_densities(squares, samples, both)))
    squares[:, 1], samples[:, 1] = np.nan, 2.0  # of a fit that diverged
    assert scale(squares, samples)[0] == both[0]
