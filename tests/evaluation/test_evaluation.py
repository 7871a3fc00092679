"""Splits, labels, metrics and the boundary."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline import splits
from pipeline.cam_follower import labels, metrics
from pipeline.chapters import boundary
from unmodelled.base.errors import BadInput

TURN = 2 * np.pi


def table(n: int, seed: int = 0) -> pd.DataFrame:
    generator = np.random.default_rng(seed)
    label = generator.choice(["contact", "jump", "stall"], n, p=[0.7, 0.2, 0.1])
    return pd.DataFrame({"label": label, "f_min": generator.normal(size=n)})


@given(st.integers(40, 300), st.integers(0, 99))
def test_subsets_partition_the_contact_runs_from_stable_to_unstable(n: int, seed: int) -> None:
    experiments = table(n, seed)
    subsets = splits.nominal_subsets(experiments)
    everything = np.concatenate(subsets)
    assert sorted(everything) == list(np.flatnonzero(experiments["label"] == "contact"))
    force = experiments["f_min"].to_numpy()[everything]
    assert (np.diff(force) <= 0).all()


@given(st.integers(60, 300), st.integers(0, 99))
def test_no_split_leaks(n: int, seed: int) -> None:
    experiments = table(n, seed)
    for split in (splits.interpolation, splits.extrapolation, splits.inner_extrapolation, splits.tuning):
        for fold in split(experiments):
            assert not set(fold.train) & set(fold.test)
            assert (experiments["label"].to_numpy()[np.r_[fold.train, fold.test]] == "contact").all()


def test_extrapolation_trains_on_more_stable_runs_than_it_tests() -> None:
    experiments = table(200)
    force = experiments["f_min"].to_numpy()
    for fold in splits.extrapolation(experiments):
        assert force[fold.train].min() >= force[fold.test].max()


def test_inner_extrapolation_stays_inside_the_first_subset() -> None:
    experiments = table(200)
    first = set(splits.nominal_subsets(experiments)[0])
    (fold,) = splits.inner_extrapolation(experiments)
    assert set(fold.train) | set(fold.test) == first


def test_too_few_contact_runs() -> None:
    with pytest.raises(BadInput, match="at least 10 are needed"):
        splits.interpolation(table(10))


def test_an_overlapping_fold_is_refused() -> None:
    with pytest.raises(ValueError, match="disjoint"):
        splits.Fold("x", np.array([1, 2]), np.array([2, 3]))


def test_a_start_just_below_zero_becomes_negative() -> None:
    angle = np.linspace(-0.1, 9.0, 500)
    np.testing.assert_allclose(labels.unwrapped(np.mod(angle, TURN)), angle, atol=1e-12)


def test_mean_extreme_leaves_out_the_first_and_the_partial_turn() -> None:
    angle = np.linspace(-0.1, 3.5 * TURN, 7000)
    turn = np.floor(angle / TURN)
    signal = np.where(np.isin(turn, [1, 2]), turn, 100.0)
    assert labels.mean_extreme(angle, signal, largest=True) == pytest.approx(1.5)
    assert np.isnan(labels.mean_extreme(np.linspace(0, TURN, 100), np.ones(100), largest=True))


@pytest.mark.parametrize(
    ("turns", "share", "expected"), [(1.4, 0.5, "stall"), (4, 0.014, "jump"), (4, 0.012, "contact")]
)
def test_label(turns: float, share: float, expected: str) -> None:
    assert labels.label(turns, share, 0.013, 1.5) == expected


def test_a_perfect_but_late_simulation_has_no_error_over_the_angle() -> None:
    t = np.arange(0, 2, 0.01)
    omega = 10 * (1 - np.exp(-t / 0.2))
    angle = np.cumsum(omega) * 0.01
    late = np.concatenate([np.zeros(30), omega])
    late_angle = np.concatenate([np.full(30, angle[0] - 1e-9), angle])
    assert metrics.angle_mse(angle, omega, late_angle, late) == pytest.approx(0.0, abs=1e-6)
    assert metrics.time_mse(omega, late) > 1.0


def test_a_stalled_simulation_counts_with_speed_zero() -> None:
    angle, omega = np.linspace(0, 10, 100), np.full(100, 5.0)
    found = metrics.angle_mse(angle, omega, np.linspace(0, 5, 50), np.full(50, 5.0))
    assert found == pytest.approx(12.5, rel=0.02)


def test_first_crossing() -> None:
    V = np.array([1.0, 2.0, 3.0, 4.0])
    assert boundary.first_crossing(V, np.array([0.0, 1.0, 3.0, 2.0]), 2.0) == pytest.approx(2.5)
    assert np.isnan(boundary.first_crossing(V, np.zeros(4), 2.0))


def test_predicted_boundary_is_clipped_to_the_grid() -> None:
    grid = pd.DataFrame({"H": [1, 1, 2, 2, 3, 3], "beta": 1.0, "m": 1.0, "V": [4.0, 6.0] * 3})
    Q = boundary.predicted(grid, np.array([1.0, -1.0, 1.0, 0.5, -0.1, -1.0]))["Q"]
    np.testing.assert_allclose(Q, [5.0, 6.0, 4.0])


def test_direct_extrapolation_recovers_a_quadratic() -> None:
    generator = np.random.default_rng(0)
    points = pd.DataFrame(generator.uniform(1, 2, (300, 4)), columns=["V", "m", "H", "beta"])
    points["f_min"] = 5 * points["m"] - points["V"] ** 2 * points["H"]
    seen, unseen = points.iloc[:250], points.iloc[250:]
    np.testing.assert_allclose(boundary.extrapolate_force(seen, unseen), unseen["f_min"], atol=0.15)
