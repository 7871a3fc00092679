"""The page of an audit: a row for every number, a row for every set, and which set predicts best."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

from unmodelled.base.wording import amounts, quantity
from unmodelled.report.headline import percent
from unmodelled.report.numbers import short, unit_text
from unmodelled.report.result_pages import write_result_page
from unmodelled.report.tables import Cell, Table

Content = Mapping[str, Any]

#: What logs say about a number: words, and class of the style sheet.
KINDS = {
    "determined": ("determined", "verdict holds"),
    "combined": ("only with others", "verdict few"),
    "undetermined": ("not determined", "verdict few"),
    "absorbs": ("absorbs a law", "verdict direction"),
    "known": ("held", "verdict untestable"),
    "wrong": ("contradicted", "verdict fails"),
}
#: What they say about a value of a set.
MARKS = {
    "agrees": "agrees",
    "absorbs": "as without the law",
    "contradicted": "contradicted",
    "open": "not decided",
}


def write_audit_page(folder: Path, content: Content, sentences: Sequence[str]) -> None:
    """Write index.html: the sentences, and the tables of numbers and sets."""
    tables = [numbers_table(content), sets_table(content)]
    write_result_page(folder, "audit.html.j2", tables, {}, None, None, content=content, sentences=sentences)


def numbers_table(content: Content) -> Table:
    """Return the table of numbers, with a column for every set."""
    names = [one["name"] for one in content["sets"]]
    rows = tuple(_number(row, names) for row in content["numbers"])
    columns = ("Number", "These logs say", "Fitted", "95 % interval", *names, "Unit", "Why")
    numeric = (False, False, True, False, *(True for _ in names), False, False)
    about = (
        "Fitted beside the laws that the model leaves out. Below every value of a set: whether it agrees, is "
        "contradicted, or holds in a model without the missing law only."
    )
    return Table("numbers", "Numbers", columns, numeric, rows, about)


def _number(row: Content, names: Sequence[str]) -> tuple[Cell, ...]:
    kind, style = KINDS[row["kind"]]
    text, interval = ("–", "") if row["value"] is None else quantity(row["value"], row["interval"])
    exact = "" if row["value"] is None else str(row["value"])
    ends = " to ".join(map(str, row["interval"] or ()))
    return (
        Cell(row["name"], row["name"]),
        Cell(kind, row["kind"], style),
        Cell(text, exact),
        Cell(interval or "–", ends),
        *(_value(row, name) for name in names),
        Cell(unit_text(row["unit"]) or "–", row["unit"]),
        Cell(row["sentence"], row["sentence"], "fold"),
    )


def _value(row: Content, name: str) -> Cell:
    own = row["sets"].get(name)
    if own is None:
        return Cell("–", "")
    return Cell(short(own["value"]), str(own["value"]), note=MARKS[own["mark"]])


def sets_table(content: Content) -> Table:
    """Return the table of sets and of numbers that are fitted to the other experiments."""
    refitted = {k: None if v is None else {"errors": v} for k, v in content["refitted"].items()}
    models = [*content["sets"], {"name": "fitted to the other experiments", "fitted": [], **refitted}]
    spans = [("as_given", ""), *([("with_laws", " with the laws")] if content["laws"] else [])]
    units = {name: own["unit"] for name, own in content["outputs"].items()}
    columns = ["Set"]
    for _, end in spans:
        columns += [*(f"{name}{end}" for name in units), f"Best{end}"]
    rows = tuple(
        (
            Cell(one["name"], one["name"], note=_fitted(one)),
            *chain(*(_errors(one[k], units) for k, _ in spans)),
        )
        for one in models
    )
    (horizon,) = amounts([content["horizon"]], "s", 3)
    about = (
        f"Root mean square errors within {horizon} in experiments that were left out, with the measurement "
        "chain fitted to the others; and the probability that the set predicts best, by the experiments."
    )
    numeric = (False, *(True for _ in columns[1:]))
    return Table("sets", "Predictions", tuple(columns), numeric, rows, about)


def _fitted(one: Content) -> str:
    return f"{', '.join(one['fitted'])} fitted" if one["fitted"] else ""


def _errors(one: Content | None, units: Mapping[str, str]) -> list[Cell]:
    errors = (one or {}).get("errors")
    if errors is None:
        return [*(Cell("diverges", "") for _ in units), Cell("–", "")]
    cells = [Cell(amounts([v], units[name], 3)[0], str(v)) for name, v in errors.items()]
    share = (one or {}).get("probability")
    return [*cells, Cell("–", "") if share is None else Cell(percent(share), str(share))]
