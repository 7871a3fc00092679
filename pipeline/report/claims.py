"""Table of the dissertation's claims with computed numbers and verdicts."""

import csv
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from pipeline.report.numbers import percentage
from unmodelled.base.errors import BadInput
from unmodelled.report.numbers import number, quantity, unit_text
from unmodelled.report.tables import Cell, Table, exact

#: The verdicts on a claim, and the name of their colour in the style sheet.
VERDICTS = {
    "holds": "holds",
    "holds in direction": "direction",
    "does not hold": "fails",
    "too few repeats": "few",
    "cannot be tested on these data": "untestable",
}

#: What every row of a claims file says.
KEYS = (
    *("id", "chapter", "page", "claim", "dissertation", "ours"),
    *("interval", "unit", "protocol", "data", "verdict"),
)

COLUMNS = ("Claim", "Page", "Dissertation", "Ours", "Verdict", "Protocol")
#: Column of the verdicts of the committed run with the full profile, and its place.
FULL, BEFORE = "Full run", COLUMNS.index("Dissertation") + 1
#: Columns where the page of the chapter shows the others.
SHORT = ("Claim", "Dissertation", FULL, "Ours", "Verdict")

#: Rows of the committed run with the full profile, by id of the claim.
Full = Mapping[str, Mapping[str, str]]


def claims_table(id: str, claims: Sequence[dict[str, Any]], full: Full | None = None) -> Table:
    """Return a table with one row per claim; verdicts of a full run stand beside those of this run."""
    columns = (*COLUMNS[:BEFORE], FULL, *COLUMNS[BEFORE:]) if full else COLUMNS
    return Table(
        id,
        "Claims of the dissertation",
        columns,
        (False,) * len(columns),
        tuple(_row(claim, full) for claim in claims),
        anchors=tuple(f"claim-{claim['id']}" for claim in claims),
        download=(KEYS, *(tuple(_saved(claim[key]) for key in KEYS) for claim in claims)),
    )


def short(claims: Table) -> Table:
    """Claims without the columns that the page of the chapter shows; every claim links to its row there."""
    columns = tuple(name for name in SHORT if name in claims.columns)
    kept = [claims.columns.index(name) for name in columns]
    rows = tuple(tuple(row[k] for k in kept) for row in claims.rows)
    return replace(claims, columns=columns, numeric=(False,) * len(columns), rows=rows, anchors=())


def read_full(path: Path) -> Full:
    """Read the claims of a run with the full profile, saved as the CSV file of their table; {} without it."""
    if not path.exists():
        return {}
    with path.open(newline="", encoding="utf-8") as file:
        rows = {str(row.get("id")): row for row in csv.DictReader(file)}
    for name, row in rows.items():
        if set(row) != set(KEYS) or row["verdict"] not in VERDICTS:
            raise BadInput(f"{path}: claim {name!r}: must have a verdict and the columns {', '.join(KEYS)}")
    return rows


def in_order(claims: Sequence[dict[str, Any]], full: Full) -> list[dict[str, Any]]:
    """Sort claims by their verdict, those that hold first; the verdict of the full run goes before."""
    return sorted(claims, key=lambda row: list(VERDICTS).index(full.get(row["id"], row)["verdict"]))


def counts(claims: Sequence[dict[str, Any]], full: Full) -> dict[str, tuple[int, int]]:
    """Count the claims by verdict: of the full run where there is one, and of this run."""
    own = [row["verdict"] for row in claims]
    said = [full[row["id"]]["verdict"] for row in claims if row["id"] in full] if full else own
    return {verdict: (said.count(verdict), own.count(verdict)) for verdict in VERDICTS}


def _row(claim: dict[str, Any], full: Full | None) -> tuple[Cell, ...]:
    theirs, ours, text = claim["dissertation"], claim["ours"], claim["claim"]
    value, note = _quantity(ours, claim["interval"], claim["unit"])
    page = f"p.\u00a0{claim['page']}" if str(claim["page"]).isdigit() else str(claim["page"])
    verdict, protocol = claim["verdict"], claim["protocol"] or ""
    # a number stays on one line, a comparison in words may wrap
    kind = "lines" if isinstance(ours, str) else "figure"
    beside = (_full(full.get(claim["id"]), claim["unit"]),) if full else ()
    return (
        Cell(text, text, "claim", f"chapter_{claim['chapter']}.html#claim-{claim['id']}"),
        Cell(f"Ch.\u00a0{claim['chapter']}, {page}", f"{claim['chapter']}, {claim['page']}", "source"),
        Cell(_quantity(theirs, None, claim["unit"])[0], exact(theirs)),
        *beside,
        Cell(value, exact(ours), kind, note=note, badge=claim["data"]),
        Cell(verdict, verdict, f"verdict {VERDICTS[verdict]}"),
        Cell(protocol or "–", protocol, "fold"),
    )


def _full(row: Mapping[str, str] | None, unit: str | None) -> Cell:
    """The verdict of the full run, with its number below."""
    if row is None:
        return Cell("–", "", "full")
    try:
        ours: Any = float(row["ours"])
    except ValueError:
        ours = row["ours"]
    note = _quantity(ours, None, unit)[0].replace("\n", "; ")
    verdict = row["verdict"]
    return Cell(verdict, verdict, f"full verdict {VERDICTS[verdict]}", note=note, badge=row["data"])


def _quantity(value: Any, interval: Sequence[float] | None, unit: str | None) -> tuple[str, str]:
    """Value with its unit, and what stands below it: the interval, or a unit too long to stand beside."""
    name = unit_text(unit)
    if not isinstance(value, int | float):
        # a unit belongs to a list of numbers, not to words
        return _lines(number(value)), name if re.search(r"\d", str(value)) else ""
    share, rest = percentage(name)
    if share:
        shown, between = quantity(100 * value, interval and [100 * end for end in interval])
        return f"{shown}\u202f%", _below(rest, f"{between}\u202f%" if between else "")
    shown, between = quantity(value, interval)
    # a long unit would push the verdict out of sight
    beside = name and len(name) < 10
    return (f"{shown} {name}", _below("", between)) if beside else (shown, _below(name, between))


def _below(unit: str, between: str) -> str:
    return ", ".join(filter(None, (unit, f"95 %: {between}" if between else "")))


def _lines(text: str) -> str:
    """A list of three or more numbers, one line each."""
    parts = re.split("[,;] ", text)
    return "\n".join(parts) if len(parts) > 2 and all(re.search(r"\d$", part) for part in parts) else text


def _saved(value: Any) -> str:
    return " to ".join(map(str, value)) if isinstance(value, list) else exact(value)
