"""Runs are judged by their own training runs alone; splits of chapter 5 leak nothing."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline import splits
from pipeline.cam_follower.jumps import Observed, example_rows, judge, threshold
from pipeline.cam_follower.labels import mean_extreme
from unmodelled.base.arrays import Array
from unmodelled.base.campaign import Campaign
from unmodelled.base.errors import BadInput
from unmodelled.learning.splits import Fold

FACTORS = ["H", "beta", "m"]


def grid(n: int, seed: int) -> pd.DataFrame:
    generator = np.random.default_rng(seed)
    table = pd.DataFrame({name: generator.choice([1.0, 2.0, 3.0, 4.0], n) for name in FACTORS})
    return table.assign(label=generator.choice(["contact", "jump", "stall"], n, p=[0.5, 0.4, 0.1]))


@given(st.integers(60, 300), st.integers(0, 99))
def test_no_split_of_jumps_leaks_or_trains_on_stalls(n: int, seed: int) -> None:
    table = grid(n, seed)
    turning = set(np.flatnonzero(table["label"] != "stall"))
    uniform = splits.uniform(table, [0.05, 0.3, 0.5], seed)
    for fold in (*uniform, *splits.alternate_levels(table, FACTORS)):
        assert not set(fold.train) & set(fold.test)
        assert set(fold.train) | set(fold.test) == turning
    assert [fold.name for fold in uniform] == ["5%", "30%", "50%"]
    assert set(uniform[0].train) < set(uniform[1].train) < set(uniform[2].train)
    assert len(uniform[1].train) == round(0.3 * len(turning))
    for fold in splits.inner_uniform(table, 0.5, 5, seed):
        assert not set(fold.train) & set(fold.test)
        assert set(fold.train) | set(fold.test) == set(uniform[2].train)


def test_joined_splits_keep_their_folds() -> None:
    table = grid(100, 0)
    one = splits.Split(lambda t: splits.uniform(t, [0.3]))
    two = splits.Split(lambda t: splits.alternate_levels(t, ["H", "m"]))
    found = splits.joined(table, {"one": one, "two": two})
    assert [fold.name for fold in found] == ["30%", "H", "m"]
    np.testing.assert_array_equal(found[0].train, splits.uniform(table, [0.3])[0].train)


@given(st.integers(60, 200), st.integers(0, 99))
def test_every_other_level_is_unseen(n: int, seed: int) -> None:
    table = grid(n, seed)
    for fold in splits.alternate_levels(table, FACTORS):
        assert set(table[fold.name].iloc[fold.train]) <= {1.0, 3.0}
        assert set(table[fold.name].iloc[fold.test]) <= {2.0, 4.0}


def test_the_draw_depends_on_the_seed() -> None:
    table = grid(100, 0)
    one, two, again = (splits.uniform(table, [0.3], seed)[0].train for seed in (0, 1, 0))
    assert set(one) != set(two) and set(one) == set(again)


@pytest.mark.parametrize("share", [0.0, 1.0, 5.0])
def test_impossible_shares_are_refused(share: float) -> None:
    with pytest.raises(BadInput, match="shares: must lie between 0 and 1"):
        splits.uniform(grid(50, 0), [share])


def test_an_unknown_factor_is_refused() -> None:
    with pytest.raises(BadInput, match="no column V"):
        splits.alternate_levels(grid(50, 0), ["V"])
    with pytest.raises(BadInput, match="fold m: no experiments"):
        splits.alternate_levels(grid(50, 0).assign(m=1.0), ["m"])


@given(st.integers(0, 999), st.floats(0.003, 0.1), st.floats(1.5, 20.0))
def test_the_threshold_lies_between_both_kinds(seed: int, middle: float, apart: float) -> None:
    """Scores of both kinds are as far from the middle, by their ratio: so is the level."""
    generator = np.random.default_rng(seed)
    spread = np.exp(np.abs(generator.normal(size=20))) * apart
    share = np.concatenate([middle / spread, middle * spread])
    level = threshold(share, np.repeat([False, True], 20), 0.01 * middle)
    assert level == pytest.approx(middle, rel=0.02)


def test_the_threshold_does_not_depend_on_two_runs_alone() -> None:
    """Where most contact runs are far below the highest of them the level is nearer to that."""
    low = np.geomspace(2e-3, 1e-2, 12)
    sparse = threshold(np.r_[low, np.full(12, 0.1)], np.repeat([False, True], 12), 0.013)
    high = np.geomspace(0.1, 0.5, 12)
    dense = threshold(np.r_[np.full(12, 1e-2), high], np.repeat([False, True], 12), 0.013)
    assert 1e-2 < sparse < np.sqrt(1e-3) < dense < 0.1


@pytest.mark.parametrize(
    ("share", "jump"),
    [
        ([0.02, 0.03], [False, False]),
        ([0.001, 0.002], [True, True]),
        ([0.02, 0.02], [False, True]),
        # below a tenth of the default all runs are alike, and so are those without any detachment
        ([1e-5, 0.0, 1e-3], [False, True, False]),
        # the larger, the more contact
        ([0.02, 0.03], [True, False]),
    ],
)
def test_runs_that_say_nothing_leave_the_default(share: list[float], jump: list[bool]) -> None:
    assert threshold(np.array(share), np.array(jump), 0.013) == 0.013


@pytest.fixture
def observed(jump_campaign: Campaign) -> Observed:
    return Observed.of(jump_campaign, 100)


@pytest.fixture
def fold(jump_campaign: Campaign) -> Fold:
    return splits.uniform(jump_campaign.experiments, [0.5])[0]


def predicted(observed: Observed, seed: int = 0) -> Array:
    """Three repeats, each wrong by its own factor."""
    target = observed.sequences.target
    return np.stack([f * target for f in (0.5, 1.0, 2.0)])


def test_the_mean_maximum_is_that_of_the_labels(jump_campaign: Campaign, observed: Observed) -> None:
    found = observed.mean_maximum(observed.sequences.target)
    whole = 0
    for i, run in enumerate(jump_campaign):
        theta, eps = run["theta"][:100], run["eps"][:100]
        expected = mean_extreme(theta, eps, largest=True)
        # a run without a full revolution counts whole
        whole += np.isnan(expected)
        assert found[i] == pytest.approx(eps.max() if np.isnan(expected) else expected)
    assert 0 < whole < len(jump_campaign)


def test_the_median_over_repeats_is_judged(observed: Observed, fold: Fold) -> None:
    tables = judge(observed, fold, predicted(observed), 0.013)
    runs, repeats = tables["runs"], tables["repeats"]
    assert list(runs["exp"]) == list(observed.experiments["exp"].iloc[fold.test])
    # the median repeat is the measurement
    np.testing.assert_allclose(runs["mse"], 0.0, atol=1e-12)
    np.testing.assert_allclose(runs["predicted"], runs["measured"])
    row = int(fold.test[3])
    n = observed.sequences.lengths[row]
    expected = 1e6 * np.mean(observed.sequences.target[row, :n] ** 2)
    own = repeats[repeats["exp"] == runs["exp"].iloc[3]].set_index("repeat")["mse"]
    np.testing.assert_allclose(own[[0, 1, 2]], [0.25 * expected, 0.0, expected], atol=1e-15)
    assert set(runs["fold"]) == {"50%"} and len(repeats) == 3 * len(runs)
    assert set(runs["label"]) == {"contact", "jump"}


def test_levels_come_from_training_runs(observed: Observed, fold: Fold) -> None:
    """Predictions of half the size are no mistakes, as the level halves too; test labels change nothing."""
    half = 0.5 * observed.sequences.target[None]
    runs = judge(observed, fold, half, 0.013)["runs"]
    assert ((runs["label"] == "jump") == runs["jumps"]).mean() > 0.9
    table = observed.experiments.copy()
    rows = table.index[fold.test]
    table.loc[rows, "label"] = np.where(table.loc[rows, "label"] == "jump", "contact", "jump")
    other = judge(replace(observed, experiments=table), fold, half, 0.013)["runs"]
    np.testing.assert_array_equal(other["jumps"], runs["jumps"])


def test_examples_are_spread_over_the_test_runs(observed: Observed, fold: Fold) -> None:
    table = observed.experiments
    rows = example_rows(table, fold.test)
    assert set(rows["jump"]) | set(rows["contact"]) <= set(fold.test)
    assert len(rows["jump"]) == 3 and (table["label"].iloc[rows["jump"]] == "jump").all()
    assert table["eps_share"].iloc[rows["jump"]].is_monotonic_increasing
    examples = judge(observed, fold, predicted(observed), 0.013)["examples"]
    assert set(examples["exp"]) == set(table["exp"].iloc[[*rows["jump"], *rows["contact"]]])
    assert examples["predicted"].between(examples["low"], examples["high"]).all()


def test_a_campaign_without_jumps_has_no_examples_of_them(observed: Observed, fold: Fold) -> None:
    table = observed.experiments.assign(label="contact")
    assert example_rows(table, fold.test)["jump"] == []


def test_a_prediction_that_is_no_number_is_named(observed: Observed, fold: Fold) -> None:
    eps = predicted(observed)
    exp = observed.experiments["exp"].iloc[5]
    eps[1, 5, 7] = np.nan
    with pytest.raises(BadInput, match=f"repeat 1: prediction of experiment {exp} is not .* at sample 7"):
        judge(observed, fold, eps, 0.013)
    # after the end of a run nothing counts
    eps = predicted(observed)
    short = int(np.argmin(observed.sequences.lengths))
    eps[0, short, -1] = np.nan
    judge(observed, fold, eps, 0.013)
