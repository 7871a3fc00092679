"""Entries of the search box of a page, and data in a page."""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import Any

from unmodelled.report.drawn import Figure
from unmodelled.report.tables import Table

Entry = dict[str, str]
#: Rows of a table that can be found.
MOST_ROWS = 500


def figure_entries(figures: Iterable[Figure], file: str) -> list[Entry]:
    """Return one entry per figure of a page."""
    return [entry("figure", f"Figure {f.number}", f.caption, f"{file}#{f.id}") for f in figures]


def table_entries(tables: Iterable[Table], file: str) -> list[Entry]:
    """Return one entry per table of a page that has rows."""
    return [entry("table", t.title, t.caption, f"{file}#{t.id}") for t in tables if t.rows]


def row_entries(tables: Iterable[Table], file: str) -> list[Entry]:
    """Return one entry per row of the tables of a page: what stands in them is found."""
    return [
        entry("table", cells[0], f"{t.title}: {' '.join(cells[1:])}", f"{file}#{t.id}")
        for t in tables
        for row in t.rows[:MOST_ROWS]
        if (cells := [f"{c.text} {c.note}".strip() for c in row])
    ]


def as_block(content: Any) -> str:
    """Return values as JSON that cannot end its own script element.

    Examples:
        >>> as_block({"name": "</script>"})
        '{"name":"\\\\u003c/script>"}'
    """
    return json.dumps(content, separators=(",", ":")).replace("<", "\\u003c")


def entry(kind: str, title: str, text: str, url: str) -> Entry:
    """Return one entry of the search box."""
    return {"kind": kind, "title": title, "text": text, "url": url}
