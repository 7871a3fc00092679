"""The page of a training: what was learned, the machine with the formulas, and names that stay text."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser

import unmodelled as um
from tests.report.test_live_page import EVIL, check_readable, errors, opened, slider

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def learned() -> um.LearnedLaws:
    system, logs = um.example("pendulum")
    return um.learned_laws(um.train(system, logs, um.one_per_port(hidden=32)), logs)


@pytest.fixture(scope="module")
def folder(learned: um.LearnedLaws, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("training") / "out"
    learned.fit.save(out)
    learned.save(out)
    return out


def test_it_says_what_was_learned_and_follows_the_coefficients(
    browser: Browser, folder: Path, learned: um.LearnedLaws
) -> None:
    table = learned.simulation.table()
    rows = table[table["experiment"] == learned.simulation.worst][1:]
    error = float(np.sqrt(np.mean((rows["theta_simulated"] - rows["theta_measured"]) ** 2)))
    with browser.new_context(viewport={"width": 1440, "height": 900}) as context:
        page = opened(context.new_page(), folder)
        sentence = " ".join(page.locator("h1").inner_text().split())
        assert sentence.startswith("The networks have learned an effort of up to 0.1")
        assert sentence.endswith("mrad instead of 52 mrad.")
        assert page.locator(".effect math").count() == 1
        before, now = errors(page)
        assert before == now == pytest.approx(error, rel=1e-6)
        slider(page, "joint_c1").press("Home")
        assert errors(page)[0] == before and errors(page)[1] != before


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("width", [390, 1440])
def test_it_can_be_read(width: int, theme: Any, browser: Browser, folder: Path) -> None:
    check_readable(browser, folder, width, theme)


def test_names_stay_text(browser: Browser, learned: um.LearnedLaws, tmp_path: Path) -> None:
    evil = replace(learned, laws=tuple(replace(law, network=EVIL) for law in learned.laws), notes=(EVIL,))
    learned.fit.save(tmp_path / "out")
    evil.save(tmp_path / "out")
    with browser.new_context(viewport={"width": 1440, "height": 900}) as context:
        page = opened(context.new_page(), tmp_path / "out")
        assert EVIL in page.locator(".notes li").all_inner_texts()
        assert page.evaluate("window.hacked === undefined && !document.querySelector('img[src=x]')")
