"""Tables as the pages show them: what is shown, and all digits beside it."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass
from typing import Any

from unmodelled.report.numbers import number, unit_text


@dataclass(frozen=True)
class Cell:
    """What a cell shows, what it is sorted by and saved as, its style, a line below, the kind of its data."""

    text: str
    exact: str
    kind: str = ""
    link: str = ""
    note: str = ""
    badge: str = ""


@dataclass(frozen=True)
class Table:
    """A table as the pages show it; `numeric` columns stand right.

    The CSV file holds what the cells are saved as, or `download`, a heading and rows, where that says more.
    """

    id: str
    title: str
    columns: tuple[str, ...]
    numeric: tuple[bool, ...]
    rows: tuple[tuple[Cell, ...], ...]
    caption: str = ""
    protocol: str = ""
    chapter: int | None = None
    data: str = ""
    anchors: tuple[str, ...] = ()
    download: tuple[tuple[str, ...], ...] = ()

    @property
    def csv(self) -> str:
        """All digits, for download."""
        text = io.StringIO()
        shown = (self.columns, *(tuple(cell.exact for cell in row) for row in self.rows))
        csv.writer(text, lineterminator="\n").writerows(self.download or shown)
        return text.getvalue()


def file_table(name: str, text: str, about: dict[str, Any]) -> Table:
    """Return a CSV file as a table; a column is numeric when every filled cell of it is."""
    columns, *rows = list(csv.reader(io.StringIO(text)))
    numbers = [[_parsed(cell) for cell in row] for row in rows]
    units = [name == "unit" for name in columns]
    cells = [
        tuple(
            Cell(unit_text(text) if unit else text if value is None else number(value), text)
            for text, value, unit in zip(row, values, units, strict=True)
        )
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


def _parsed(text: str) -> float | int | None:
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return None


def exact(value: Any) -> str:
    """Return all digits of a value; an empty text where there is no value."""
    return "" if value is None else str(value)
