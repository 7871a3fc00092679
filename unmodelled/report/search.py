"""What the search box looks through: an entry for everything that can be found, as a script."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence

from unmodelled.report.drawn import Figure
from unmodelled.report.tables import Table

Entry = dict[str, str]


def figure_entries(figures: Iterable[Figure], file: str) -> list[Entry]:
    """Return one entry for every figure of the page `file`."""
    return [entry("figure", f"Figure {f.number}", f.caption, f"{file}#{f.id}") for f in figures]


def table_entries(tables: Iterable[Table], file: str) -> list[Entry]:
    """Return one entry for every filled table of the page `file`."""
    return [entry("table", t.title, t.caption, f"{file}#{t.id}") for t in tables if t.rows]


def script(entries: Sequence[Entry]) -> str:
    """Return the entries as JavaScript that cannot end the element it stands in."""
    text = json.dumps(entries, indent=0).replace("<", "\\u003c")
    return f"window.SEARCH = {text};\n"


def entry(kind: str, title: str, text: str, url: str) -> Entry:
    """Return one entry; `url` is seen from the page with the box."""
    return {"kind": kind, "title": title, "text": text, "url": url}
