"""Write the site: index.html, and all other files in the folder site."""

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipeline.report.claims import VERDICTS, counts
from pipeline.report.numbers import duration
from pipeline.report.pages import Contents, Page, contents, pages
from pipeline.report.results import Diagnosis, Results
from pipeline.report.runs import (
    campaigns_table,
    configuration_file,
    executions_table,
    provenance_table,
    runs_table,
    settings,
    stages_table,
    versions_table,
)
from unmodelled.base.files import replacing, replacing_folder
from unmodelled.base.ownership import check_replaceable
from unmodelled.report.diagnosis_page import live_data, view
from unmodelled.report.numbers import number
from unmodelled.report.rendering import LIVE_SCRIPTS, ORIGINS, STATIC, check_own_page, templates
from unmodelled.report.search import Entry, as_block, entry, figure_entries, table_entries
from unmodelled.report.tables import Table

TEMPLATES = Path(__file__).with_name("templates")
#: Styles and script of the pages, and the licence of the plots of a live machine.
ASSETS = ("style.css", "report.js", "uplot.min.css", "uplot.LICENSE.txt")
#: What the home page says of itself in its head, so that no other index.html is taken for an earlier one.
GENERATOR = '<meta name="generator" content="pipeline site">'


@dataclass(frozen=True)
class Site:
    """All pages with their content."""

    results: Results
    pages: list[Page]  # in the order of the navigation
    shown: dict[str, Contents]  # content of the pages by id
    #: What was run, when and with what, by the id of the table.
    record: dict[str, Table]

    def origin(self, page: Page) -> str:
        """Return the kind of the data of a page: from its campaign, its content, or all campaigns."""
        if page.campaign in self.results.campaigns:
            return str(self.results.campaigns[page.campaign]["data"])
        every = {str(about["data"]) for about in self.results.campaigns.values()}
        kinds = self.shown[page.id].origins if page.campaign else every
        return "both" if len(kinds) > 1 else next(iter(kinds), "")


def check_place(out: Path) -> None:
    """Refuse a folder with other pages at the places of the site and its home page."""
    check_replaceable(out / "site")
    check_own_page(out / "index.html", GENERATOR, "site")


def build(results: Results, out: Path) -> None:
    """Write the site; equal results give equal bytes."""
    check_place(out)
    every = pages(results)
    shown = {page.id: contents(page, results) for page in every}
    site = Site(results, every, shown, _record(every, results))
    html = {page.file: _render(page.template, page.file, page, site) for page in every}
    tables = [*site.record.values(), *results.tables]
    tables += [table for c in shown.values() for table in (c.claims, *c.metrics) if table.rows]
    tables += [table for c in shown.values() for found in c.topics for table in found.tables]
    with replacing_folder(out / "site") as folder, replacing(out / "index.html") as home:
        for file, text in html.items():
            (home if file.startswith("..") else folder / file).write_text(text)
        _write_tables(tables, folder / "tables")
        (folder / "figures").mkdir()
        for figure in results.figures:
            shutil.copyfile(figure.source, folder / "figures" / figure.source.name)
        (folder / "configs").mkdir()
        for execution in results.executions:
            (folder / "configs" / configuration_file(execution)).write_text(execution["configuration"])
        for diagnosis in results.diagnoses:
            _write_diagnosis(diagnosis, site, folder)
        for asset in (*ASSETS, *(script.name for script in LIVE_SCRIPTS)):
            shutil.copyfile(STATIC / asset, folder / asset)
        (folder / "search.js").write_text(f"window.SEARCH = {as_block(index(every, shown, results))};\n")


def _write_tables(tables: Sequence[Table], folder: Path) -> None:
    folder.mkdir()
    for table in tables:
        (folder / f"{table.id}.csv").write_text(table.csv)


def _write_diagnosis(diagnosis: Diagnosis, site: Site, folder: Path) -> None:
    """Its page in the frame of the site, and its figures and tables beside the page."""
    content = view(diagnosis.folder)
    owner = next(page for page in reversed(site.pages) if diagnosis in site.shown[page.id].diagnoses)
    page = Page(owner.id, diagnosis.label, diagnosis.headline)
    target = (folder / diagnosis.file).parent
    target.mkdir(parents=True)
    live = {"live": live_data(diagnosis.folder, content), "live_scripts": [s.name for s in LIVE_SCRIPTS]}
    more = {**content, **live, "owner": owner.label, "label": diagnosis.label, "mixed": []}
    text = _render("diagnosis_in_site.html.j2", diagnosis.file, page, site, more)
    (folder / diagnosis.file).write_text(text)
    _write_tables(content["tables"], target / "tables")
    (target / "figures").mkdir()
    for figure in content["figures"].values():
        shutil.copyfile(figure.source, target / "figures" / figure.source.name)


def _record(every: Sequence[Page], results: Results) -> dict[str, Table]:
    tables = (
        campaigns_table(results.campaigns, _shown_on(every, results)),
        stages_table(results.executions),
        executions_table(results.executions),
        runs_table(results.runs),
        versions_table(results.executions),
        provenance_table(results.metrics),
    )
    return {table.id: table for table in tables}


def _shown_on(every: Sequence[Page], results: Results) -> dict[str, tuple[str, str]]:
    """Labels and first address of the pages with results of a campaign, or of a whole that it belongs to."""
    found = {}
    for name in results.campaigns:
        on = [p for p in every if p.campaign and name.startswith(p.campaign.split("/")[0])]
        if on:
            found[name] = (", ".join(p.label for p in on), on[0].file)
    return found


def _render(template: str, file: str, page: Page, site: Site, more: Mapping[str, Any] | None = None) -> str:
    """The text of a page that will be `file`, seen from the site folder."""
    root = "site/" if file.startswith("..") else "../" * file.count("/")

    def address(other: str) -> str:
        # from the home page the way into the site folder and out again would be the long one
        return other.removeprefix("../") if root == "site/" and other.startswith("../") else root + other

    origin = site.origin(page)
    frame = {
        "page": page,
        "pages": site.pages,
        "shown": site.shown,
        "here": site.shown[page.id],
        "results": site.results,
        "campaign": site.results.campaigns.get(page.campaign, {}),
        "record": site.record,
        "settings": settings(site.results.metrics),
        "root": root,
        "address": address,
        "origin": origin,
        "banner": ORIGINS[origin],
        "mixed": sorted(site.shown[page.id].origins - {origin}) if origin != "both" else [],
        "verdicts": VERDICTS,
        "counts": counts(site.results.claims, site.results.full),
        "generator": GENERATOR,
        "number": number,
        "duration": duration,
    }
    return templates(TEMPLATES).get_template(template).render({**frame, **(more or {}), "root": root})


def index(every: Sequence[Page], shown: Mapping[str, Contents], results: Results) -> list[Entry]:
    """Return the search entries of pages, figures, claims, tables, numbers and diagnoses."""
    found = [entry("page", page.title, f"{page.label} {page.summary}", page.file) for page in every]
    found += [entry("diagnosis", d.label, d.headline, d.file) for d in results.diagnoses]
    for page in every[1:]:
        here = shown[page.id]
        for answer in here.topics:
            topic = answer.topic
            found.append(entry("page", topic.title, topic.asks, f"{page.file}#{topic.id}"))
        found += figure_entries(here.figures, page.file)
        verdict = here.claims.columns.index("Verdict")
        for row, anchor in zip(here.claims.rows, here.claims.anchors, strict=True):
            found.append(entry("claim", row[0].text, row[verdict].text, f"{page.file}#{anchor}"))
        found += table_entries(here.tables, page.file)
        for t in here.metrics:
            names = " ".join(row[0].text for row in t.rows)
            found.append(entry("metrics", t.title, names, f"{page.file}#{t.id}"))
    return found
