"""Reader of the tables of a system file: CSV files beside it."""

from __future__ import annotations

import csv
import itertools
import math
from pathlib import Path
from typing import Literal

from unmodelled.systems.document import Node, file_beside
from unmodelled.systems.syntax import shown
from unmodelled.systems.tables import Table

_LARGEST = 10_000_000


def read_table(name: str, node: Node) -> Table:
    """Read a characteristic from a CSV file beside the system file."""
    entries = node.fields(("file", "x", "y"), ("kind",))
    kind: Literal["cubic", "linear"] = "cubic"
    if "kind" in entries:
        written = entries["kind"].text()
        if written not in ("cubic", "linear"):
            raise entries["kind"].wrong(f"must be cubic or linear, got {shown(written)}")
        kind = "linear" if written == "linear" else "cubic"
    rows = _rows(file_beside(entries["file"], _LARGEST), entries["file"])
    x, y = (_column(rows, entries[axis]) for axis in ("x", "y"))
    file = entries["file"].text()
    if len(x) < 2:
        raise node.wrong(f"{shown(file)}: must have at least 2 rows of numbers, got {len(x)}")
    for row, (before, after) in enumerate(itertools.pairwise(x), start=3):
        if not before < after:
            column = shown(entries["x"].text())
            raise node.wrong(f"{shown(file)}: row {row}, column {column}: must increase, got {after!r}")
    return Table(name, x, y, kind)


def _rows(path: Path, node: Node) -> list[list[str]]:
    try:
        with path.open(encoding="utf-8-sig", newline="") as lines:
            rows = [[cell.strip() for cell in row] for row in csv.reader(lines)]
    except (OSError, UnicodeDecodeError, csv.Error):
        raise node.wrong(f"{shown(node.text())}: not a CSV file in UTF-8: save it as such") from None
    if not rows:
        raise node.wrong(f"{shown(node.text())}: the file is empty: write a header and at least 2 rows")
    while not any(rows[-1]) and len(rows) > 1:
        rows.pop()
    return rows


def _column(rows: list[list[str]], node: Node) -> tuple[float, ...]:
    name = node.text()
    if rows[0].count(name) != 1:
        got = ", ".join(shown(cell) for cell in rows[0][:10])
        raise node.wrong(f"the table must have one column {shown(name)}, got {got}")
    k = rows[0].index(name)
    return tuple(_cell(row, k, i, node) for i, row in enumerate(rows[1:], start=2))


def _cell(row: list[str], k: int, number: int, node: Node) -> float:
    place = f"row {number}, column {shown(node.text())}"
    if k >= len(row):
        raise node.wrong(f"{place}: the cell is missing: write a number")
    try:
        value = float(row[k])
    except ValueError:
        raise node.wrong(f"{place}: must be a number, got {shown(row[k])}") from None
    if not math.isfinite(value):
        raise node.wrong(f"{place}: must be a finite number, got {shown(row[k])}")
    return value
