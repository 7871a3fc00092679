"""The rates that README.md and docs/withheld state are those of the committed rows of the benchmark.

Those of README.md are of the present diagnosis, the table of docs/withheld is of the search among fits.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from benchmarks.withheld.score import share
from pipeline.withheld.judging import CONFIDENT

DOCS = Path(__file__).parents[2] / "docs"
Rows = list[dict[str, Any]]


def read_rows(decision: str) -> Rows:
    return [json.loads(line) for line in (DOCS / "decisions" / decision).read_text().splitlines()]


ROWS = [
    *read_rows("0015/rows_fresh.jsonl"),
    *read_rows("0016/rows.jsonl"),
    *read_rows("0016/rows_fresh.jsonl"),
]
EVIDENCE = read_rows("0018/rows.jsonl")
FIVE = [row for row in ROWS if row["case"].startswith("70")]
FIFTEEN = [row for row in ROWS if "further" in row["case"]]
#: Beginning of a line of the table, entry and kind of the rows.
STATED = {
    "singles: named first": ("first", "single"),
    "in the set": ("in_set", "single"),
    "nulls right": ("right", "null"),
    "pairs: right": ("right", "pair"),
    "three or four effects: right": ("right", "several"),
    "outside the library: right": ("right", "outside"),
    "confidently wrong anywhere": ("", ""),
}


def rate(rows: Rows, name: str) -> str:
    key, kind = STATED[name]
    if not key:
        return share(
            [row["confidence"] >= CONFIDENT and not row["right"] for row in rows if not row["error"]]
        )
    return share([bool(row[key]) for row in rows if row["kind"] == kind])


def test_exact_pairs_are_those_of_the_rows() -> None:
    rates = [share([bool(row["exact"]) for row in rows if row["kind"] == "pair"]) for rows in (FIVE, FIFTEEN)]
    assert f"| exactly | {' | '.join(rates)} |" in (DOCS / "withheld" / "README.md").read_text()


def in_words(text: str) -> str:
    count, _, per_cent = text.partition(": ")
    return f"{per_cent} of {count.split(' of ')[1]}"


def test_no_case_counts_twice() -> None:
    assert len({row["case"] for row in ROWS}) == len(ROWS)


@pytest.mark.parametrize("name", STATED)
def test_the_rates_are_those_of_the_rows(name: str) -> None:
    rates = [rate(rows, name) for rows in (FIVE, FIFTEEN)]
    lines = (DOCS / "withheld" / "README.md").read_text().splitlines()
    (line,) = [line for line in lines if line.startswith(f"| {name}")]
    assert line.endswith(f"| {' | '.join(rates)} |")


#: Question and kind of the lines of the first page, which are of classes (`benchmarks.withheld.ruler`).
ASKED = [
    *(("first", "single"), ("told", "single"), ("about", "single"), ("right", "null")),
    *(("exact", "pair"), ("material", "several"), ("right", "outside")),
]


@pytest.mark.parametrize(("question", "kind"), ASKED)
def test_the_first_page_has_the_rates_of_the_present_diagnosis(question: str, kind: str) -> None:
    asked = [row[question] for row in EVIDENCE if row["kind"] == kind and row[question] is not None]
    assert f"| {in_words(share(list(map(bool, asked))))} |" in (DOCS.parent / "README.md").read_text()


#: Lines of the table of other entrants, and their names in its rows.
ENTRANTS = {
    **{"this project": "unmodelled", "re-identified": "file", "mujoco.sysid": "sysid"},
    **{"mujoco.sysid, no stiffness": "sysid_joints", "CMA-ES (PACE)": "cma", "PySINDy": "pysindy"},
    **{"pyoperon": "pyoperon", "always dry friction": "coulomb"},
}


@pytest.mark.parametrize("title", ENTRANTS)
def test_the_rates_of_other_entrants_are_those_of_their_rows(title: str) -> None:
    path = DOCS / "withheld" / "entrants.csv"
    every = pd.read_csv(path, keep_default_na=False, na_values=[""])  # a kind is called null
    rows = every[every["entrant"] == ENTRANTS[title]]
    assert len(rows) == 48
    single, null = (rows[rows["kind"] == kind] for kind in ("single", "null"))
    cells = [
        share(list(single["in_set"])),
        f"{rows['named'].sum()} of {rows['planted'].sum()}",
        str(rows["beyond"].sum()),
        share(list(null["right"])),
        share(list(rows["worse"].dropna())) or "–",
        f"{rows['cpu'].median():.0f}",
    ]
    assert f"| {title} | {' | '.join(cells)} |" in (DOCS / "withheld" / "README.md").read_text()
