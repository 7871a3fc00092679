"""Tables of a page: formatted cells, and exact values for sorting and download."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass
from typing import Any

from unmodelled.report.numbers import number, unit_text


@dataclass(frozen=True)
class Cell:
    """Content of one cell."""

    text: str
    exact: str  # for sorting and for the CSV file
    kind: str = ""  # class of the style sheet
    link: str = ""  # address
    note: str = ""  # line below the text
    badge: str = ""  # origin of the data


@dataclass(frozen=True)
class Table:
    """A table of a page and its CSV file."""

    id: str  # anchor on the page, and name of the CSV file
    title: str
    columns: tuple[str, ...]
    numeric: tuple[bool, ...]  # of each column: aligned to the right
    rows: tuple[tuple[Cell, ...], ...]
    caption: str = ""  # text below the title
    protocol: str = ""  # how the numbers were computed
    chapter: int | None = None  # of the dissertation
    data: str = ""  # origin; empty: unknown
    anchors: tuple[str, ...] = ()  # of every row
    #: Heading and rows of the CSV file; default: the exact values of the cells.
    download: tuple[tuple[str, ...], ...] = ()

    @property
    def csv(self) -> str:
        """Text of the CSV file with all digits."""
        text = io.StringIO()
        shown = (self.columns, *(tuple(cell.exact for cell in row) for row in self.rows))
        csv.writer(text, lineterminator="\n").writerows(self.download or shown)
        return text.getvalue()


def number_cell(value: Any, missing: str = "–") -> Cell:
    """Return the cell of a number, which may be missing."""
    return Cell(missing, "") if value is None else Cell(number(value), exact(value))


def error_cell(value: float | None) -> Cell:
    """Return the cell of an error; a simulation that diverges has none."""
    return number_cell(value, "diverges")


def unit_cell(unit: str) -> Cell:
    """Return the cell of a unit."""
    return Cell(unit_text(unit) or "–", unit)


def exact(value: Any) -> str:
    """Format a value with all digits."""
    return "" if value is None else str(value)
