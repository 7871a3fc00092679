"""What each page of the site holds: a new page is one line of `PAGES`, or that and a template."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pipeline.report.tables import Table, claims_table, metrics_table


@dataclass(frozen=True)
class Page:
    """One page: everything of `chapter`, and what is named; "a|b" names the first of the two that exists."""

    id: str
    label: str
    title: str
    template: str = "chapter.html.j2"
    summary: str = ""
    chapter: int | None = None
    campaign: str = ""
    figures: tuple[str, ...] = ()
    tables: tuple[str, ...] = ()
    metrics: tuple[str, ...] = ()

    @property
    def file(self) -> str:
        """Address, seen from the site folder."""
        return "../index.html" if self.id == "index" else f"{self.id}.html"


LEAD = ("fig_6_20", "fig_6_23|fig_6_24", "fig_5_11")

PAGES = (
    Page("index", "Home", "Hybrid physics-based neural network models", "home.html.j2", figures=LEAD),
    Page(
        "chapter_3",
        "Chapter 3",
        "Uncertain parameters of a wet clutch",
        summary="The bench of the dissertation was never published. This one is virtual, its parameters are "
        "invented but plausible: relations between methods compare with the text, absolute numbers do not.",
        chapter=3,
        campaign="clutch",
    ),
    Page(
        "chapter_4",
        "Chapter 4",
        "Neural networks that complete the physics of a slider-crank",
        chapter=4,
        campaign="slider_crank",
    ),
    Page(
        "chapter_5",
        "Chapter 5",
        "Follower jumps: geometry, features, prediction, explanation",
        chapter=5,
        metrics=("cam_labels",),
    ),
    Page("chapter_6", "Chapter 6", "Beyond nominal operation", chapter=6),
    Page(
        "emps",
        "EMPS",
        "A real positioning axis: what its model leaves out",
        summary="Public measurements of a carriage on a ball screw. Withheld from the known physics is its "
        "dry friction, its viscous friction, or nothing: what the diagnosis finds, and what it cannot "
        "explain.",
        campaign="emps",
        tables=("emps", "emps_numbers", "emps_left_over"),
        metrics=("real",),
    ),
    Page(
        "cam_drivetrain",
        "Cam drivetrain",
        "The measured drivetrain of the cam-follower: what its model leaves out",
        summary="Sixteen of the dissertation's contact runs. Withheld from the known physics is the friction "
        "of the follower's guide, the follower's inertia, or nothing: what the diagnosis finds, and what it "
        "cannot explain.",
        campaign="cam_drivetrain",
        tables=("cam_drivetrain", "cam_drivetrain_numbers", "cam_drivetrain_left_over"),
        metrics=("real",),
    ),
    Page(
        "withheld",
        "Withheld check",
        "Diagnoses of virtual machines with planted faults",
        summary="Five virtual machines that share no code with the models, with faults that the diagnosis is "
        "not told. Every miss is listed.",
        campaign="withheld/single",
        figures=("fig_W_1", "fig_W_2", "fig_W_3", "fig_W_4", "fig_W_5"),
        tables=("withheld", "withheld_misses"),
        metrics=("withheld",),
    ),
    Page("data", "Data & provenance", "Data & provenance", "data.html.j2"),
    Page("runs", "Runs", "Runs", "runs.html.j2"),
)


@dataclass(frozen=True)
class Figure:
    """A numbered SVG file; `size` is its width and height in pixels."""

    id: str
    number: str
    chapter: int | None
    caption: str
    note: str
    command: str
    data: str
    source: Path
    size: tuple[int, int] | None


@dataclass(frozen=True)
class Results:
    """Everything that was read."""

    claims: list[dict[str, Any]] = field(default_factory=list)
    figures: list[Figure] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    metrics: dict[str, dict[str, Any]] = field(default_factory=dict)
    campaigns: dict[str, dict[str, Any]] = field(default_factory=dict)
    runs: dict[str, dict[str, Any]] = field(default_factory=dict)
    equations: list[dict[str, Any]] = field(default_factory=list)

    def campaign(self, page: Page) -> dict[str, Any]:
        """Where the data of `page` come from; a page of no campaign of its own shows the first one."""
        first = next(iter(self.campaigns.values()), {})
        return self.campaigns.get(page.campaign, first)

    def chapter_of(self, topic: str) -> int | None:
        """Chapter of a metrics file: as it says itself, or by its name."""
        match = re.fullmatch(r"chapter(\d+)", topic)
        chapter: int | None = self.metrics[topic].get("chapter", int(match[1]) if match else None)
        return chapter


@dataclass(frozen=True)
class Contents:
    """What stands on one page."""

    claims: Table
    figures: list[Figure]
    tables: list[Table]
    metrics: list[Table]
    equations: list[dict[str, str]]

    @property
    def origins(self) -> set[str]:
        """Kinds of data that the claims, figures and numbers on the page were made from."""
        tables = {table.data for table in (*self.tables, *self.metrics)}
        claims = {row[-1].exact for row in self.claims.rows}
        return (tables | claims | {figure.data for figure in self.figures}) - {""}


def pages(results: Results) -> list[Page]:
    """The declared pages, one more for every other chapter with results, and one for what belongs nowhere."""
    found = {figure.chapter for figure in results.figures} | {table.chapter for table in results.tables}
    found |= {row["chapter"] for row in results.claims} | {
        results.chapter_of(topic) for topic in results.metrics
    }
    new = found - {page.chapter for page in PAGES}
    extra = [Page(f"chapter_{n}", f"Chapter {n}", f"Chapter {n}", chapter=n) for n in new if n is not None]
    chapters = sorted((p for p in (*PAGES, *extra) if p.chapter is not None), key=lambda p: p.chapter or 0)
    rest = [page for page in PAGES[1:] if page.chapter is None]
    return [PAGES[0], *chapters, *_leftovers(results), *rest]


def _leftovers(results: Results) -> list[Page]:
    figures = {name for page in PAGES for choice in page.figures for name in choice.split("|")}
    tables = {name for page in PAGES for name in page.tables}
    topics = {name for page in PAGES for name in page.metrics}
    page = Page(
        "other",
        "Other results",
        "Other results",
        figures=tuple(f.id for f in results.figures if f.chapter is None and f.id not in figures),
        tables=tuple(t.id for t in results.tables if t.chapter is None and t.id not in tables),
        metrics=tuple(t for t in results.metrics if results.chapter_of(t) is None and t not in topics),
    )
    return [page] if page.figures or page.tables or page.metrics else []


def contents(page: Page, results: Results) -> Contents:
    """Choose what stands on `page`."""

    def here(chapter: int | None) -> bool:
        return chapter is not None and chapter == page.chapter

    by_id = {figure.id: figure for figure in results.figures}
    named = [next((by_id[n] for n in choice.split("|") if n in by_id), None) for choice in page.figures]
    picked = [figure for figure in named if figure is not None]
    claims = [row for row in results.claims if page.id == "index" or here(row["chapter"])]
    topics = [t for t in results.metrics if here(results.chapter_of(t)) or t in page.metrics]
    return Contents(
        claims_table(f"claims-{page.id}", claims),
        picked + [f for f in results.figures if here(f.chapter) and f not in picked],
        [t for t in results.tables if here(t.chapter) or t.id in page.tables],
        [metrics_table(topic, results.metrics[topic]) for topic in topics],
        [row for block in results.equations if here(block["chapter"]) for row in block["rows"]],
    )
