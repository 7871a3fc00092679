"""The tutorial is a text with its figures in their places; it reads without results too."""

import re
from pathlib import Path
from xml.etree import ElementTree

import pytest

from tests.report.case import claim, figure, make, put, write_inputs

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
