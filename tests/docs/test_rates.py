"""The rates that README.md and docs/withheld state are those of the committed rows of the benchmark."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from benchmarks.withheld.score import share
from pipeline.withheld.judging import CONFIDENT

DOCS = Path(__file__).parents[2] / "docs"
ROWS = [
    json.loads(line) for line in (DOCS / "decisions" / "0015" / "rows_fresh.jsonl").read_text().splitlines()
]


def asked(key: str, *kinds: str) -> list[bool]:
    rows: list[dict[str, Any]] = [row for row in ROWS if not kinds or row["kind"] in kinds]
    return [bool(row[key]) for row in rows if row.get(key) is not None]


CONFIDENTLY_WRONG = [row["confidence"] >= CONFIDENT and not row["right"] for row in ROWS]
STATED = {
    "singles: named first": asked("first", "single"),
    "in the set": asked("in_set", "single"),
    "nulls right": asked("right", "null"),
    "pairs: right": asked("right", "pair"),
    "three or four effects: right": asked("right", "several"),
    "outside the library: right": asked("right", "outside"),
    "confidently wrong anywhere": CONFIDENTLY_WRONG,
}


@pytest.mark.parametrize("name", STATED)
def test_the_rates_are_those_of_the_rows(name: str) -> None:
    rate = share(STATED[name])
    (line,) = [
        line
        for line in (DOCS / "withheld" / "README.md").read_text().splitlines()
        if line.startswith(f"| {name}")
    ]
    assert rate in line
    count, _, per_cent = rate.partition(": ")
    assert f"| {per_cent} of {count.split(' of ')[1]} |" in (DOCS.parent / "README.md").read_text()
