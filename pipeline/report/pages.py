"""Content of every page of the site; a new page is one line of `PAGES`, or a line and a template."""

from dataclasses import dataclass
from typing import Any

from pipeline.report.challenges import CHALLENGES
from pipeline.report.claims import claims_table, in_order, short
from pipeline.report.metrics import ABOUT, metrics_table
from pipeline.report.outlook import OUTLOOK
from pipeline.report.results import Diagnosis, Results
from pipeline.report.topics import Answered, Topic, answered
from unmodelled.report.drawn import Figure
from unmodelled.report.tables import Table


@dataclass(frozen=True)
class Page:
    """A page of the site: all results of its chapter, and further results by name."""

    id: str  # name of the file without suffix
    label: str  # in the navigation
    title: str
    template: str = "chapter.html.j2"
    summary: str = ""  # below the title
    chapter: int | None = None  # of the dissertation
    campaign: str = ""  # whose results the page shows
    group: str = "Chapters"  # heading in the navigation
    figures: tuple[str, ...] = ()  # ids; "a|b" stands for the first one of the two that exists
    tables: tuple[str, ...] = ()  # ids
    metrics: tuple[str, ...] = ()  # names of metrics files
    topics: tuple[Topic, ...] = ()  # that the chapter names
    command: str = "make report"  # computes missing results

    @property
    def file(self) -> str:
        """Address relative to the folder of the site."""
        return "../index.html" if self.id == "index" else f"{self.id}.html"


LEAD = ("fig_6_24", "fig_6_20", "fig_5_16|fig_5_11")
REAL = "make real EMPS=<folder with DATA_EMPS.mat> XL330=<zip file or folder>"

PAGES = (
    Page(
        "index",
        "Home",
        "What the models of these machines leave out",
        "home.html.j2",
        group="",
        figures=LEAD,
        tables=("real_answers",),
    ),
    Page(
        "chapter_1",
        "Chapter 1",
        "Four challenges, and the results that answer them",
        summary="Hybrid models shall be accurate, reliable and explainable, and shall work on real machines: "
        "chapter 1 of the dissertation names four challenges. Every claim of this report belongs to one of "
        "them.",
        chapter=1,
        topics=CHALLENGES,
    ),
    Page(
        "chapter_2",
        "Tutorial",
        "Physics, networks, and why to combine them",
        "tutorial.html.j2",
        summary="The ideas behind everything else, in ten minutes: chapter 2 of the dissertation with its "
        "examples computed, on a virtual motor and a virtual pendulum.",
        chapter=2,
        campaign="tutorial",
    ),
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
        summary="Known is the mechanism; left out are a spring and friction at the slider. A network inside "
        "the equation of motion learns the missing load from angle and speed alone. The bench is virtual, "
        "for the dissertation's measurements were never published.",
        chapter=4,
        campaign="slider_crank",
    ),
    Page(
        "chapter_5",
        "Chapter 5",
        "Follower jumps: geometry, features, prediction, explanation",
        summary="A follower that is driven fast enough leaves its cam. F† is the force that would keep it "
        "there, computed from the motor side alone. LSTMs predict the distance ε from the cam: tau1 from the "
        "encoder, tau2 from F† too, tau3 also from the shape of the cam, tau4 from F† and the motion along "
        "the cam in place of the encoder.",
        chapter=5,
        campaign="cam_follower",
        metrics=("cam_labels",),
    ),
    Page(
        "chapter_6",
        "Chapter 6",
        "Beyond nominal operation",
        summary="Models see the most stable contact runs only and simulate the rest: at which voltage Q does "
        "the follower start to jump? f_bb is a black box, f_h1 the soft hybrid, f_h2 the hybrid, lls a "
        "linear model, motor an identified DC motor, best the same motor with a network. narx (a network "
        "that also reads the last samples), rnn (a recurrent network) and gp (a Gaussian process) are black "
        "boxes of chapter 2's overview. I1 to I10 are the contact runs in tenths, the most stable first.",
        chapter=6,
        campaign="cam_follower",
    ),
    Page(
        "chapter_7",
        "Chapter 7",
        "The outlook: what exists of it, and what is missing",
        summary="Chapter 7 of the dissertation suggests topics of future research, from the theory (section "
        "7.2.1) to the machine (section 7.2.2). Each topic stands beside what this project has of it.",
        chapter=7,
        topics=OUTLOOK,
    ),
    Page(
        "real",
        "Measured machines",
        "Diagnoses of published machines, compared with what is known of them",
        summary="Each system file leaves out an effect that is known from elsewhere, or nothing. The "
        "diagnosis reads the system file and the logs only. One table compares the answers of this run with "
        "what is known, and names the part of the diagnosis that failed; another one has those of the "
        "committed run.",
        campaign="real",
        group="Diagnosis",
        tables=("real_answers", "real", "real_numbers", "real_gaps", "real_left_over"),
        metrics=("real",),
        command=REAL,
    ),
    Page(
        "withheld",
        "Withheld check",
        "Diagnoses of virtual machines with planted faults",
        summary="Five virtual machines that share no code with the models, with faults that the diagnosis is "
        "not told. Every miss is listed.",
        campaign="withheld/single",
        group="Diagnosis",
        figures=("fig_W_1", "fig_W_2", "fig_W_3", "fig_W_4", "fig_W_5"),
        tables=("withheld", "withheld_misses"),
        metrics=("withheld",),
    ),
    Page(
        "benchmarks",
        "Speed",
        "Speed against peers",
        summary="Seconds of this project and of a peer for the same work, side by side in one run; the "
        "ratio is that of the peer's time to ours, with its range over repetitions.",
        group="Record",
        tables=("benchmarks",),
        metrics=("benchmarks",),
        command="make bench",
    ),
    Page("data", "Data & provenance", "Data & provenance", "data.html.j2", group="Record"),
    Page("runs", "Runs", "Runs", "runs.html.j2", group="Record"),
)


@dataclass(frozen=True)
class Contents:
    """Content of one page."""

    claims: Table
    figures: list[Figure]
    tables: list[Table]
    metrics: list[Table]  # tables of numbers
    equations: list[dict[str, str]]  # rows of kind, text and mathml
    diagnoses: list[Diagnosis]
    topics: list[Answered]  # with their results

    @property
    def empty(self) -> bool:
        """Whether the page has no results."""
        lists = self.figures, self.tables, self.metrics, self.equations, self.diagnoses, self.topics
        return not self.claims.rows and not any(lists)

    @property
    def origins(self) -> set[str]:
        """Kinds of the data behind the claims, figures and numbers of the page."""
        answers = [table for found in self.topics for table in found.tables]
        tables = {table.data for table in (*self.tables, *self.metrics, *answers)}
        claims = {cell.badge for t in (self.claims, *answers) for row in t.rows for cell in row}
        return (tables | claims | {figure.data for figure in self.figures}) - {""}


def pages(results: Results) -> list[Page]:
    """Return the declared pages, and further pages for other chapters and for results without a chapter."""
    found = {figure.chapter for figure in results.figures} | {table.chapter for table in results.tables}
    found |= {row["chapter"] for row in results.claims} | {
        results.chapter_of(topic) for topic in results.metrics
    }
    new = found - {page.chapter for page in PAGES}
    extra = [Page(f"chapter_{n}", f"Chapter {n}", f"Chapter {n}", chapter=n) for n in new if n is not None]
    chapters = sorted((p for p in (*PAGES, *extra) if p.chapter is not None), key=lambda p: p.chapter or 0)
    rest = [page for page in PAGES[1:] if page.chapter is None]
    return [PAGES[0], *chapters, *rest, *_leftovers(results)]


def _leftovers(results: Results) -> list[Page]:
    figures = {name for page in PAGES for choice in page.figures for name in choice.split("|")}
    tables = {name for page in PAGES for name in page.tables}
    topics = {name for page in PAGES for name in page.metrics}
    page = Page(
        "other",
        "Other results",
        "Other results",
        group="Record",
        figures=tuple(f.id for f in results.figures if f.chapter is None and f.id not in figures),
        tables=tuple(t.id for t in results.tables if t.chapter is None and t.id not in tables),
        metrics=tuple(t for t in results.metrics if results.chapter_of(t) is None and t not in topics),
    )
    return [page] if page.figures or page.tables or page.metrics else []


def contents(page: Page, results: Results) -> Contents:
    """Choose the content of a page."""

    def here(chapter: int | None) -> bool:
        return chapter is not None and chapter == page.chapter

    by_id = {figure.id: figure for figure in results.figures}
    named = [next((by_id[n] for n in choice.split("|") if n in by_id), None) for choice in page.figures]
    picked = [figure for figure in named if figure is not None]
    rows = [row for row in results.claims if here(row["chapter"])]
    if page.id == "index":
        rows = in_order(results.claims, results.full)
    claims = claims_table(f"claims-{page.id}", rows, results.full)
    topics = [t for t in results.metrics if here(results.chapter_of(t)) or t in page.metrics]
    return Contents(
        short(claims) if page.id == "index" else claims,
        picked + [f for f in results.figures if here(f.chapter) and f not in picked],
        [t for t in results.tables if here(t.chapter) or t.id in page.tables],
        [_metrics(topic, results.metrics[topic], page.campaign) for topic in topics],
        [row for block in results.equations if here(block["chapter"]) for row in block["rows"]],
        [d for d in results.diagnoses if page.id == "index" or page.campaign in d.name.split("/")],
        [answered(topic, results) for topic in page.topics],
    )


def _metrics(topic: str, content: dict[str, Any], campaign: str) -> Table:
    """The numbers of a campaign where the file has them apart, else all."""
    if campaign not in content:
        return metrics_table(f"metrics-{topic}", content)
    part = {key: content[key] for key in (*ABOUT, campaign) if key in content}
    return metrics_table(f"metrics-{topic}-{campaign}", part)
