"""Table of the dissertation's claims with computed numbers and verdicts."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from unmodelled.report.numbers import number, percentage, quantity, unit_text
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
    "id",
    "chapter",
    "page",
    "claim",
    "dissertation",
    "ours",
    "interval",
    "unit",
    "protocol",
    "data",
    "verdict",
)

COLUMNS = ("Claim", "Page", "Dissertation", "Ours", "Verdict", "Protocol")


def claims_table(id: str, claims: Sequence[dict[str, Any]]) -> Table:
    """Return a table with one row per claim."""
    return Table(
        id,
        "Claims of the dissertation",
        COLUMNS,
        (False,) * len(COLUMNS),
        tuple(_row(claim) for claim in claims),
        anchors=tuple(f"claim-{claim['id']}" for claim in claims),
        download=(KEYS, *(tuple(_saved(claim[key]) for key in KEYS) for claim in claims)),
    )


def _row(claim: dict[str, Any]) -> tuple[Cell, ...]:
    theirs, ours, text = claim["dissertation"], claim["ours"], claim["claim"]
    value, note = _quantity(ours, claim["interval"], claim["unit"])
    page = f"p.\u00a0{claim['page']}" if str(claim["page"]).isdigit() else str(claim["page"])
    verdict, protocol = claim["verdict"], claim["protocol"] or ""
    # a number stays on one line, a comparison in words may wrap
    kind = "lines" if isinstance(ours, str) else "figure"
    return (
        Cell(text, text, "claim", f"chapter_{claim['chapter']}.html#claim-{claim['id']}"),
        Cell(f"Ch.\u00a0{claim['chapter']}, {page}", f"{claim['chapter']}, {claim['page']}", "source"),
        Cell(_quantity(theirs, None, claim["unit"])[0], exact(theirs)),
        Cell(value, exact(ours), kind, note=note, badge=claim["data"]),
        Cell(verdict, verdict, f"verdict {VERDICTS[verdict]}"),
        Cell(protocol or "–", protocol, "fold"),
    )


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
