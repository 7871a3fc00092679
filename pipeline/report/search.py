"""What the search box looks through; addresses are seen from the site folder."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence

from pipeline.report.pages import Contents, Page
from pipeline.report.results import Figure, Results
from pipeline.report.tables import Table

Entry = dict[str, str]


def index(every: Sequence[Page], shown: Mapping[str, Contents], results: Results) -> list[Entry]:
    """Pages, figures, claims, tables, numbers and diagnoses."""
    found = [_entry("page", page.title, f"{page.label} {page.summary}", page.file) for page in every]
    found += [_entry("diagnosis", d.label, d.headline, d.file) for d in results.diagnoses]
    for page in every[1:]:
        here = shown[page.id]
        found += figure_entries(here.figures, page.file)
        for row, anchor in zip(here.claims.rows, here.claims.anchors, strict=True):
            found.append(_entry("claim", row[0].text, row[4].text, f"{page.file}#{anchor}"))
        found += table_entries(here.tables, page.file)
        for t in here.metrics:
            names = " ".join(row[0].text for row in t.rows)
            found.append(_entry("metrics", t.title, names, f"{page.file}#{t.id}"))
    return found


def figure_entries(figures: Iterable[Figure], file: str) -> list[Entry]:
    """One entry for every figure of the page `file`."""
    return [_entry("figure", f"Figure {f.number}", f.caption, f"{file}#{f.id}") for f in figures]


def table_entries(tables: Iterable[Table], file: str) -> list[Entry]:
    """One entry for every filled table of the page `file`."""
    return [_entry("table", t.title, t.caption, f"{file}#{t.id}") for t in tables if t.rows]


def script(entries: Sequence[Entry]) -> str:
    """The entries as JavaScript that cannot end the element it stands in."""
    text = json.dumps(entries, indent=0).replace("<", "\\u003c")
    return f"window.SEARCH = {text};\n"


def _entry(kind: str, title: str, text: str, url: str) -> Entry:
    return {"kind": kind, "title": title, "text": text, "url": url}
