"""What a study knows: levels of experiments, which are held out, and thresholds that a user can set."""

from collections import Counter
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import unmodelled as um
from tests.diagnosis.benches import Bench
from tests.diagnosis.studies import HORIZON
from unmodelled.diagnosis.data.levels import MOST_LEVELS, levels
from unmodelled.diagnosis.data.study import Study, held_out
from unmodelled.diagnosis.fitting.hypothesis import Hypothesis

tables = st.lists(st.sampled_from("abcd"), min_size=2, max_size=14)


def table(**factors: list[object]) -> pd.DataFrame:
    count = len(next(iter(factors.values())))
    return pd.DataFrame({"id": [f"run{i}" for i in range(count)], "file": "log.csv", **factors})


@settings(max_examples=40, deadline=None)
@given(tables, st.integers(0, 50))
def test_a_quarter_at_least_one_always_the_same(groups: list[object], seed: int) -> None:
    experiments = table(group=groups)
    chosen = held_out(experiments, seed)
    assert len(set(chosen)) == len(chosen) == max(1, round(0.25 * len(groups)))
    assert list(chosen) == sorted(chosen) and set(chosen) < set(range(len(groups)))
    assert held_out(experiments, seed) == chosen


@settings(max_examples=40, deadline=None)
@given(tables, st.integers(0, 50), st.booleans())
def test_every_level_stays_among_the_learned_if_it_can(
    groups: list[object], seed: int, measured: bool
) -> None:
    """Also beside a column in which every experiment has its own value."""
    beside = {"temperature": list(np.linspace(18.0, 23.0, len(groups)))} if measured else {}
    chosen = held_out(table(group=groups, **beside), seed)
    seen = Counter(g for i, g in enumerate(groups) if i not in chosen)
    lost = len(set(groups) - set(seen))
    could_go = len(groups) - len(set(groups))
    assert lost == max(0, len(chosen) - could_go)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 50))
def test_levels_of_two_factors(seed: int) -> None:
    loads = [1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 4.0, 4.0]
    rigs = ["new", "old"] * 4
    chosen = held_out(table(load=loads, group=rigs), seed)
    learned = [i for i in range(8) if i not in chosen]
    assert {loads[i] for i in learned} == set(loads) and {rigs[i] for i in learned} == set(rigs)


def test_seeds_differ() -> None:
    experiments = table(group=["a"] * 12)
    drawn = {held_out(experiments, seed) for seed in range(20)}
    assert len(drawn) > 10
    assert {i for chosen in drawn for i in chosen} == set(range(12))


@pytest.mark.parametrize("seed", range(10))
def test_one_of_few_experiments_of_a_level_is_held_out(seed: int) -> None:
    loads = np.isin(np.arange(11), (0, 8, 10)).astype(float)
    chosen = held_out(table(load=loads.tolist()), seed)
    assert len(chosen) == 3 and np.sum(loads[list(chosen)]) == 1.0


def test_an_input_from_a_slower_clock_has_its_own_period(tmp_path: Path) -> None:
    system, logs = Bench(samples=600, runs=4).recorded(tmp_path)
    t = np.arange(600.0)
    smooth = np.sin(2e-4 * t**2) + 0.3 * np.sin(0.03 * t)
    slow = np.interp(t, t[::8], smooth[::8])
    triangle = np.abs(np.mod(t, 40.0) - 20.0)
    held = np.repeat(smooth[::8], 8)
    for course, samples in ((slow, 8.0), (smooth, 1.0), (triangle, 1.0), (held, 1.0)):
        found = Study.of(system, replace(logs, u=np.tile(course, 4)[:, None]), HORIZON, 0)
        assert found.input_periods["torque"] == pytest.approx(samples * logs.period)
        timing = next(u for u in Hypothesis.known(found).unknowns if u.name.startswith("timing"))
        assert timing.high == pytest.approx(0.6 * samples * logs.period)


def levels_of(**factors: list[object]) -> list[tuple[str, float | str, list[int]]]:
    return [(factor, level, members.tolist()) for factor, level, members in levels(table(**factors))]


def test_levels_of_settings_and_groups() -> None:
    mass, group = [2, 1, 2, 1], ["new", "old", "old", "new"]
    first, *others = levels_of(mass=mass, group=group)
    assert first == ("mass", 1.0, [1, 3]) and type(first[1]) is float  # a plain number
    assert others == [("mass", 2.0, [0, 2]), ("group", "new", [0, 3]), ("group", "old", [1, 2])]


def test_a_column_that_is_no_factor() -> None:
    """All alike, all different, or a reading rather than a setting."""
    readings = [float(i // 2) for i in range(2 * MOST_LEVELS + 2)]
    assert [levels_of(column=column) for column in (["a"] * 3, list("abc"), readings)] == [[], [], []]


def test_a_level_of_one_experiment_cannot_be_told_from_chance() -> None:
    assert levels_of(group=["a", "b", "a"]) == [("group", "a", [0, 2])]


def test_rows_count_from_the_first_of_the_table() -> None:
    table = pd.DataFrame({"id": list("pqrst"), "group": list("ababa")}).iloc[[1, 2, 3]]
    assert [(level, members.tolist()) for _, level, members in levels(table)] == [("b", [0, 2])]


def test_every_option_is_changed_by_its_name() -> None:
    assert um.Options().changed == {}
    for name, value in asdict(um.Options()).items():
        other = value + 1 if name == "most_equal" else 0.5 * value
        assert um.Options.of({name: other}).changed == {name: other}


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"level": 1.5}, "options: level: must be between 0 and 1, got 1.5"),
        ({"level": float("nan")}, "options: level: must be between 0 and 1, got nan"),
        ({"level": "high"}, "options: level: must be between 0 and 1, got high"),
        ({"most_equal": 2.5}, "options: most_equal: must be a whole number from 0 on, got 2.5"),
        ({"levle": 0.9}, "did you mean 'level'?"),
    ],
)
def test_what_cannot_be_used_is_refused(given: dict[str, Any], said: str) -> None:
    with pytest.raises(um.BadInput) as fault:
        um.Options.of(given)
    assert said in str(fault.value) and "\n" not in str(fault.value)


@pytest.mark.long
def test_an_answer_is_made_with_them_and_says_so() -> None:
    system, logs = um.example("pendulum")
    usual, sure = um.diagnose(system, logs), um.diagnose(system, logs, options={"level": 0.999})
    assert usual.verdict == sure.verdict == "effect" and "options" not in usual.content
    narrow, wide = (np.ptp(answer.effects[0].F_c.interval) for answer in (usual, sure))
    assert wide > 1.3 * narrow and sure.content["options"] == {"level": 0.999}
    for answer, alpha in ((usual, 0.05), (sure, 0.001), (usual, 0.001)):
        told = answer.conf_int(alpha).loc["F_c", ["low", "high"]].tolist()
        level = sure if alpha < 0.05 else usual
        assert told == pytest.approx(level.effects[0].F_c.interval, rel=1e-6)
    assert usual.fit is not None and usual.fit.converged
    assert usual.fit.evaluations > 10 and usual.fit.seconds is not None and usual.fit.seconds > 0.1
