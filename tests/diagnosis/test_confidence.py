"""The confidence is counted on the committed rows of the benchmark."""

import json
from collections import defaultdict
from pathlib import Path

import pytest

from unmodelled.diagnosis.decide.confidence import MEASURED, alike, confidence

DECISIONS = Path(__file__).parents[2] / "docs" / "decisions"
ROWS = DECISIONS / "0015" / "rows_fresh.jsonl", DECISIONS / "0016" / "rows.jsonl"


def test_the_shares_are_those_of_the_rows() -> None:
    found: dict[tuple[str, int], list[int]] = defaultdict(lambda: [0, 0])
    for row in (json.loads(line) for rows in ROWS for line in rows.read_text().splitlines()):
        if not row["error"] and row["verdict"] in MEASURED:
            counted = found[row["verdict"], alike(row["verdict"], row["named"], row["shrink"])]
            counted[0] += bool(row["right"])
            counted[1] += 1
    expected = {(verdict, k): [*pair] for verdict, pairs in MEASURED.items() for k, pair in enumerate(pairs)}
    assert dict(found) == expected


def test_many_effects_count_as_the_most_that_were_counted() -> None:
    assert confidence("effect", 7, 1.0) == confidence("effect", 3, 1.0) < confidence("effect", 1, 1.0) < 1.0
    right, every = MEASURED["no_gap"][0]
    assert confidence("no_gap", 0, 0.0) == pytest.approx((right + 1) / (every + 2))


def test_a_main_effect_that_explains_less_than_half_is_less_sure() -> None:
    assert confidence("main_effect", 1, 0.49) < confidence("main_effect", 1, 0.5)
