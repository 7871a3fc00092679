"""What the search box of the site looks through; addresses are seen from the site folder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from pipeline.report.pages import Contents, Page
from pipeline.report.results import Results
from unmodelled.report.search import Entry, entry, figure_entries, table_entries


def index(every: Sequence[Page], shown: Mapping[str, Contents], results: Results) -> list[Entry]:
    """Pages, figures, claims, tables, numbers and diagnoses."""
    found = [entry("page", page.title, f"{page.label} {page.summary}", page.file) for page in every]
    found += [entry("diagnosis", d.label, d.headline, d.file) for d in results.diagnoses]
    for page in every[1:]:
        here = shown[page.id]
        found += figure_entries(here.figures, page.file)
        for row, anchor in zip(here.claims.rows, here.claims.anchors, strict=True):
            found.append(entry("claim", row[0].text, row[4].text, f"{page.file}#{anchor}"))
        found += table_entries(here.tables, page.file)
        for t in here.metrics:
            names = " ".join(row[0].text for row in t.rows)
            found.append(entry("metrics", t.title, names, f"{page.file}#{t.id}"))
    return found
