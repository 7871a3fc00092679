"""The page of an audit: a row for every number and every set, on any width, with names that stay text."""

import json
from copy import deepcopy
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser

from tests.browser import faults, opened
from tests.report.test_live_page import EVIL
from unmodelled.design.audit.content import lines, sentences
from unmodelled.report.audit_page import write_audit_page

NUMBER: dict[str, Any] = {
    "name": "b",
    "unit": "N m s/rad",
    "known": 0.01,
    "kind": "absorbs",
    "value": 0.015,
    "interval": [0.0149, 0.0151],
    "moves": [],
    "tied": [],
    "sentence": "b absorbs Coulomb friction at joint",
    "sets": {
        "tuned": {"value": 0.0254, "mark": "absorbs"},
        "system file": {"value": 0.01, "mark": "contradicted"},
    },
}
HELD = {"name": "g", "unit": "m/s^2", "kind": "known", "value": None, "interval": None, "sentence": "held"}


def predicted(name: str, as_given: float, with_laws: float | None, chance: float) -> dict[str, Any]:
    errors = None if with_laws is None else {"theta": with_laws}
    return {
        "name": name,
        "fitted": ["J"],
        "as_given": {"errors": {"theta": as_given}, "probability": chance},
        "with_laws": {"errors": errors, "probability": 1.0 - chance},
    }


CONTENT: dict[str, Any] = {
    "schema": "audit/1",
    "system": "pendulum",
    "experiments": ["run1", "run2"],
    "horizon": 0.2,
    "verdict": "effect",
    "laws": ["Coulomb friction at joint"],
    "outputs": {"theta": {"unit": "deg"}},
    "numbers": [NUMBER, NUMBER | HELD | {"sets": {"system file": {"value": 9.81, "mark": "agrees"}}}],
    "sets": [predicted("tuned", 0.9752, None, 0.99), predicted("system file", 2.45, 0.3443, 0.01)],
    "refitted": {"as_given": {"theta": 1.2}, "with_laws": {"theta": 0.09}},
    "notes": ["theta was unwrapped"],
}


@pytest.mark.parametrize("width", [390, 1440])
def test_a_row_a_number_and_a_row_a_set_can_be_read(width: int, browser: Browser, tmp_path: Path) -> None:
    write_audit_page(tmp_path, CONTENT, list(sentences(CONTENT)))
    with opened(browser, tmp_path / "index.html", viewport={"width": width, "height": 844}) as page:
        title = page.locator("h1").inner_text()
        assert title.startswith("As the model stands, tuned predicts best: theta 0.975")
        numbers, sets = (page.locator(f"#{name} tbody tr") for name in ("numbers", "sets"))
        assert numbers.count() == len(CONTENT["numbers"])
        assert sets.count() == len(CONTENT["sets"]) + 1
        said = numbers.first.inner_text()
        assert all(word in said for word in ("absorbs a law", "0.0254", "as without the law", "contradicted"))
        assert "diverges" in sets.first.inner_text() and "99" in sets.first.inner_text()
        assert not faults(page)


def test_names_of_files_and_numbers_stay_text(browser: Browser, tmp_path: Path) -> None:
    text = json.dumps(CONTENT).replace('"tuned"', json.dumps(EVIL)).replace('"b"', json.dumps(EVIL))
    evil = json.loads(text.replace('"pendulum"', json.dumps(EVIL)))
    write_audit_page(tmp_path, evil, list(sentences(evil)))
    with opened(browser, tmp_path / "index.html") as page:
        assert page.evaluate("window.hacked === undefined && !document.querySelector('img[src=x]')")
        assert EVIL in page.locator("#sets tbody tr").first.inner_text()


def test_the_terminal_has_a_row_a_number_and_a_row_a_set() -> None:
    shown = lines(CONTENT)
    (row,) = [line for line in shown if line.startswith("b ")]
    assert row.split() == ["b", "absorbs", "0.0254", "absorbs", "0.01", "contradicted"]
    (best,) = [line for line in shown if line.startswith("tuned ")]
    assert best.split() == ["tuned", "theta", "0.975", "deg", "diverges"]
    assert shown[1].startswith("With Coulomb friction at joint, which the model leaves out, the system file")


def test_without_a_missing_law_there_is_one_sentence() -> None:
    content = deepcopy(CONTENT) | {"laws": []}
    for one in (*content["sets"], content["refitted"]):
        one["with_laws"] = None
    content["sets"][0]["as_given"]["probability"] = 0.7
    (sentence,) = sentences(content)
    assert "tuned seems to predict best (probability 70 %)" in sentence
    assert not any("missing laws" in line for line in lines(content))
