"""Tables of the report from CSV files."""

from __future__ import annotations

import csv
import io
from typing import Any

from unmodelled.report.numbers import number, unit_text
from unmodelled.report.tables import Cell, Table

#: Characters from which a text is a sentence.
SENTENCE = 40


def file_table(name: str, text: str, about: dict[str, Any]) -> Table:
    """Convert a CSV file to a table; a column is numeric if all its filled cells are numbers.

    Sentences get a column that is wide enough for them.
    """
    columns, *rows = list(csv.reader(io.StringIO(text)))
    numbers = [[_parsed(cell) for cell in row] for row in rows]
    units = [name == "unit" for name in columns]
    cells = [
        tuple(_file_cell(text, value, unit) for text, value, unit in zip(row, values, units, strict=True))
        for row, values in zip(rows, numbers, strict=True)
    ]
    numeric = tuple(
        all(row[i].exact == "" or values[i] is not None for row, values in zip(cells, numbers, strict=True))
        for i in range(len(columns))
    )
    title, caption, protocol = (about.get(key) or "" for key in ("title", "caption", "protocol"))
    chapter = about.get("chapter")
    data = about.get("data") or ""
    caption = "" if caption == title else caption
    return Table(name, title or name, tuple(columns), numeric, tuple(cells), caption, protocol, chapter, data)


def _file_cell(text: str, value: float | int | None, unit: bool) -> Cell:
    if unit:
        return Cell(unit_text(text), text)
    if value is None:
        return Cell(text, text, "words" if len(text) > SENTENCE else "")
    return Cell(number(value), text)


def _parsed(text: str) -> float | int | None:
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return None
