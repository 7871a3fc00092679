"""The tutorial with its figures in their places; chapters 1 and 7, whose topics show what exists."""

import csv
import json
import re
from collections import Counter
from pathlib import Path
from xml.etree import ElementTree

import pytest

from pipeline.report.challenges import CHALLENGES
from pipeline.report.claims import VERDICTS
from pipeline.report.outlook import OUTLOOK
from pipeline.report.pages import PAGES
from pipeline.report.results import Results
from pipeline.report.topics import Topic, answered
from tests.report.case import HEAD, LEAF, claim, figure, make, put, write_inputs
from unmodelled.cli.program import LIBRARY

SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 500 300"/>'
NUMBERS = ("2.4", "2.8", "2.9", "2.16", "2.17", "2.17.1")


@pytest.fixture
def inputs(tmp_path: Path) -> Path:
    folder = write_inputs(tmp_path / "inputs")
    put(folder / "figures" / "figures.json", [figure(number) for number in NUMBERS])
    for number in NUMBERS:
        put(folder / "figures" / f"fig_{number.replace('.', '_')}.svg", SVG)
    put(folder / "tutorial" / "claims.json", [claim(id="static_inside", chapter=2)])
    return folder


def test_figures_stand_in_the_text_in_their_order(inputs: Path, tmp_path: Path) -> None:
    page = make(inputs, tmp_path / "out")["site/chapter_2.html"]
    places = [page.index(f"<strong>Figure {number}.</strong>") for number in NUMBERS]
    assert places == sorted(places)
    headings = [page.index(f'<h2 id="{name}">') for name in ("physics", "networks", "dynamics", "hybrid")]
    assert headings[0] < places[0] < headings[1] < places[1] < places[2] < headings[2] < places[3]
    assert places[4] < headings[3] < places[5] < page.index('<h2 id="claims">')


def test_equations_are_well_formed_and_gradient_descent_descends(inputs: Path, tmp_path: Path) -> None:
    page = make(inputs, tmp_path / "out")["site/chapter_2.html"]
    formulas = [ElementTree.fromstring(text) for text in re.findall(r"<math.*?</math>", page, re.S)]
    texts = ["".join(formula.itertext()) for formula in formulas]
    assert [text[text.rindex("(") :] for text in texts[:-1]] == [
        *("(2.1)", "(fig. 2.4a)", "(2.2)", "(2.5)", "(2.6)", "(2.8)")
    ]
    assert "αji−γj∂E∂αj" in texts[3]


def test_it_reads_without_results_and_leads_on(tmp_path: Path) -> None:
    page = make(tmp_path / "nothing", tmp_path / "out")["site/chapter_2.html"]
    assert "No results here yet" in page and "make report" in page
    assert all(f'href="chapter_{number}.html"' in page for number in (3, 4, 5, 6))
    assert "<figure" not in page and 'id="claims"' not in page


REPORTS = Path(__file__).parents[2] / "reports"
CLAIMS = json.loads((REPORTS / "claims.json").read_text())
METRICS = {path.stem: json.loads(path.read_text()) for path in (REPORTS / "metrics").glob("*.json")}
TOPICS = pytest.mark.parametrize("topic", [*CHALLENGES, *OUTLOOK], ids=lambda topic: topic.id)


def test_every_claim_belongs_to_one_challenge() -> None:
    named = Counter(name for topic in CHALLENGES for name in topic.claims)
    assert named == Counter(row["id"] for row in CLAIMS)
    assert len(CHALLENGES) == 4 and all(topic.claims for topic in CHALLENGES)


@TOPICS
def test_what_a_topic_names_exists(topic: Topic) -> None:
    found = answered(topic, Results(claims=CLAIMS, metrics=METRICS))
    assert len(found.claims.rows) == len(topic.claims)
    rows = [row[0].exact for table in found.numbers for row in table.rows]
    for name in topic.numbers:
        key = name.partition(".")[2]
        assert any(f"{row}.".startswith(f"{key}.") for row in rows), name
    assert set(topic.pages) <= {page.id for page in PAGES} and topic.pages
    assert set(topic.verbs) <= {path.stem for path in LIBRARY.verbs.glob("*.py")} and topic.verbs


def test_verdicts_and_numbers_are_those_of_the_files(tmp_path: Path) -> None:
    inputs = write_inputs(tmp_path / "inputs")
    topic = next(topic for topic in CHALLENGES if len(topic.claims) >= len(VERDICTS))
    given = dict(zip(VERDICTS, topic.claims, strict=False))
    claims = [claim(id=name, verdict=verdict, ours=7.125, unit="m") for verdict, name in given.items()]
    put(inputs / "bench" / "claims.json", claims)
    put(inputs / "metrics" / "real.json", {**HEAD, "cases": {"holds": LEAF | {"value": 0.75}, "other": LEAF}})
    out = tmp_path / "out"
    page = make(inputs, out)["site/chapter_1.html"]
    tallied = re.findall(r'<span class="verdict (\w+)">([^<]+): (\d+)<', page)
    assert sorted(tallied) == sorted((kind, verdict, "1") for verdict, kind in VERDICTS.items())
    assert all(f'href="chapter_6.html#claim-{name}"' in page for name in given.values())
    assert page.count("7.125") >= len(VERDICTS)
    assert page.count("No claims yet") == len(CHALLENGES) - 1
    rows = (out / "site" / "tables" / "metrics-real-validation.csv").read_text().splitlines()
    assert rows[1].startswith("cases.holds,0.75,") and len(rows) == 3


def test_every_page_leads_to_both_and_both_read_without_results(tmp_path: Path) -> None:
    pages = make(tmp_path / "nothing", tmp_path / "out")
    for name, topics in (("chapter_1", CHALLENGES), ("chapter_7", OUTLOOK)):
        assert all(f'{name}.html"' in text for text in pages.values())
        page = pages[f"site/{name}.html"]
        assert all(f'<h2 id="{topic.id}">' in page and f'href="#{topic.id}"' in page for topic in topics)
        assert "Nothing here yet" not in page and "<table" not in page
        assert f"{len(topics)} topics" in pages["index.html"]
    search = (tmp_path / "out" / "site" / "search.js").read_text()
    assert 'chapter_7.html#sensing"' in search


#: Verdicts of docs/real/README.md in the words of the home page.
IN_WORDS = {
    "`no_gap`": "nothing is missing",
    "`unknown`": "something is missing, of no law of the library",
    "`main_effect`: ": "mainly ",
    "`effect`: ": "",
}


def test_the_committed_answers_of_measured_machines_are_on_the_home_page() -> None:
    with (REPORTS / "tables" / "real_answers.csv").open(newline="") as file:
        rows = list(csv.reader(file))[1:]
    page = (REPORTS.parent / "docs" / "real" / "README.md").read_text()
    for code, words in IN_WORDS.items():
        page = page.replace(code, words)
    assert all(f"| {' | '.join(row)} |" in page for row in rows)
    right = sum(row[-1] != "no" for row in rows)
    title = json.loads((REPORTS / "tables" / "real_answers.json").read_text())["title"]
    assert f"{right} of {len(rows)} answers" in title and f"**{right} of {len(rows)} are right**" in page
