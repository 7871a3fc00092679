"""The page of an identified distribution: its sentence, figures and machine, and names that stay text."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from playwright.sync_api import Browser

import unmodelled as um
from tests.report.test_live_page import EVIL, check_readable, errors, opened, slider
from unmodelled.api.uncertainty_page import write_page
from unmodelled.uncertainty.response import Formula


@pytest.fixture(scope="module")
def found() -> um.IdentifiedUncertainty:
    return um.identify_uncertainty(*um.example("flywheel"), data_sets=4)


@pytest.fixture(scope="module")
def folder(found: um.IdentifiedUncertainty, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("uncertainty") / "out"
    found.save(out)
    write_page(found, out, *um.example("flywheel"))
    return out


def test_it_says_what_scatters_and_has_the_machine(browser: Browser, folder: Path) -> None:
    with browser.new_context(viewport={"width": 1440, "height": 900}) as context:
        page = opened(context.new_page(), folder)
        sentence = " ".join(page.locator("h1").inner_text().split())
        assert sentence.startswith("T_b: mean 0.884 (0.84 to 0.922), standard deviation 0.0928 (0.07")
        assert sentence.endswith("in multiples of the system file, from 24 observations.")
        assert page.locator("#estimates tbody tr").count() == 6
        # the means are lower than the file's value, and predict the times better
        before, now = errors(page)
        assert before != now
        slider(page, "T_b").press("Home")
        assert errors(page)[0] == before and errors(page)[1] != now


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("width", [390, 1440])
def test_it_can_be_read(width: int, theme: Any, browser: Browser, folder: Path) -> None:
    check_readable(browser, folder, width, theme)


@pytest.mark.long
def test_a_response_has_no_machine_and_names_stay_text(browser: Browser, tmp_path: Path) -> None:
    gain = np.linspace(1.0, 2.0, 8)
    model = Formula(("theta",), np.array([[0.5, 1.5]]), lambda theta: theta * gain)
    drawn = gain * np.random.default_rng(0).normal(1.0, 0.1, 8)
    observed = pd.DataFrame({"id": [f"P{k}" for k in range(8)], "y": drawn})
    found = um.identify_response(model, observed, data_sets=2)
    evil = replace(found, content={**found.content, "parameters": [EVIL], "advice": [EVIL]})
    evil.save(tmp_path / "out")
    write_page(evil, tmp_path / "out")
    with browser.new_context(viewport={"width": 1440, "height": 900}) as context:
        page = context.new_page()
        page.goto((tmp_path / "out" / "index.html").as_uri())
        assert page.locator("#live-machine").count() == 0
        assert EVIL in page.locator(".notes li").all_inner_texts()
        assert page.evaluate("window.hacked === undefined && !document.querySelector('img[src=x]')")
