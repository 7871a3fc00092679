"""What some experiments have in common."""

from __future__ import annotations

import pandas as pd
import pytest

from unmodelled.diagnosis.data.levels import levels
from unmodelled.diagnosis.data.thresholds import DEFAULT_THRESHOLDS


def found(**factors: list[object]) -> list[tuple[str, float | str, list[int]]]:
    count = len(next(iter(factors.values())))
    experiments = pd.DataFrame({"id": [f"r{i}" for i in range(count)], "file": "log.csv", **factors})
    return [(factor, level, members.tolist()) for factor, level, members in levels(experiments)]


def test_levels_of_settings_and_groups() -> None:
    assert found(mass=[2, 1, 2, 1], group=["new", "old", "old", "new"]) == [
        ("mass", 1.0, [1, 3]),
        ("mass", 2.0, [0, 2]),
        ("group", "new", [0, 3]),
        ("group", "old", [1, 2]),
    ]


def test_levels_of_numbers_are_plain_numbers() -> None:
    (first, _) = found(mass=[2, 1, 2, 1])
    assert type(first[1]) is float


@pytest.mark.parametrize(
    "column",
    [
        ["a", "a", "a"],
        ["a", "b", "c"],
        [float(i // 2) for i in range(2 * DEFAULT_THRESHOLDS.most_levels + 2)],
    ],
)
def test_a_column_that_is_no_factor(column: list[object]) -> None:
    """All alike, all different, or a reading rather than a setting."""
    assert found(column=column) == []


def test_a_level_of_one_experiment_cannot_be_told_from_chance() -> None:
    assert found(group=["a", "b", "a"]) == [("group", "a", [0, 2])]


def test_rows_count_from_the_first_of_the_table() -> None:
    table = pd.DataFrame({"id": list("pqrst"), "group": list("ababa")}).iloc[[1, 2, 3]]
    assert [(level, members.tolist()) for _, level, members in levels(table)] == [("b", [0, 2])]
