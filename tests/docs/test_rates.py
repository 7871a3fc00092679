"""The rates that README.md and docs/withheld state are those of the committed rows of the benchmark."""

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


def read_rows(name: str) -> Rows:
    return [json.loads(line) for line in (DOCS / "decisions" / "0018" / name).read_text().splitlines()]


#: Of the present diagnosis and of the search among fits, of the same cases.
EVIDENCE, SEARCH = read_rows("rows.jsonl"), read_rows("search.jsonl")
#: Beginning of a line of the table, entry and kind of the rows.
STATED = {
    "singles: named first": ("first", "single"),
    "in the set": ("in_set", "single"),
    "nulls right": ("right", "null"),
    "pairs: right": ("right", "pair"),
    "three or four effects: right": ("right", "several"),
    "outside the library: right": ("right", "outside"),
}


def rate(rows: Rows, name: str) -> str:
    """Rate by the scorer, whose entries have names of their own where the ruler has one, too."""
    key, kind = STATED[name]
    return share([bool(row.get(f"scored_{key}", row[key])) for row in rows if row["kind"] == kind])


def in_words(text: str) -> str:
    count, _, per_cent = text.partition(": ")
    return f"{per_cent} of {count.split(' of ')[1]}"


def test_both_answered_every_case_once() -> None:
    names = [row["case"] for row in EVIDENCE]
    assert len(set(names)) == len(names) and sorted(names) == sorted(row["case"] for row in SEARCH)


@pytest.mark.parametrize("name", STATED)
def test_the_rates_are_those_of_the_rows(name: str) -> None:
    rates = [rate(rows, name) for rows in (EVIDENCE, SEARCH)]
    lines = (DOCS / "withheld" / "README.md").read_text().splitlines()
    (line,) = [line for line in lines if line.startswith(f"| {name}")]
    assert line.startswith(f"| {name} | {' | '.join(rates)} |")


def test_confidently_wrong_answers_are_those_of_the_rows() -> None:
    wrong = share([row["confidence"] >= CONFIDENT and not row["right"] for row in EVIDENCE])
    assert f"confidently wrong are {wrong}" in (DOCS / "withheld" / "README.md").read_text()


#: Question and kind of the lines of the table of classes (`benchmarks.withheld.ruler`).
ASKED = [
    *(("first", "single"), ("told", "single"), ("about", "single"), ("right", "null")),
    *(("exact", "pair"), ("material", "several"), ("right", "outside")),
]


#: Those that the first page states.
FIRST = (("first", "single"), ("right", "null"), ("exact", "pair"), ("material", "several"))


@pytest.mark.parametrize(("question", "kind"), ASKED)
def test_the_rates_by_classes_are_those_of_the_rows(question: str, kind: str) -> None:
    asked = [row[question] for row in EVIDENCE if row["kind"] == kind and row[question] is not None]
    said = in_words(share(list(map(bool, asked))))
    assert f"| {said} |" in (DOCS / "withheld" / "README.md").read_text()
    assert (question, kind) not in FIRST or said in (DOCS.parent / "README.md").read_text()


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
