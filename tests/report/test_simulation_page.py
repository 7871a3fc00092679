"""The page of a simulation: its sentence, its machine, and names that stay text."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser

import unmodelled as um
from tests.report.test_live_page import EVIL, check_readable, errors, opened, slider


@pytest.fixture(scope="module")
def simulation() -> um.Simulation:
    return um.simulate(*um.example("pendulum"))


@pytest.fixture(scope="module")
def folder(simulation: um.Simulation, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("simulation") / "out"
    simulation.save(out)
    return out


def test_it_says_how_far_off_the_model_is_and_follows_its_sliders(
    browser: Browser, folder: Path, simulation: um.Simulation
) -> None:
    table = simulation.table()
    rows = table[table["experiment"] == simulation.worst][1:]  # a free run begins at the first sample
    error = float(np.sqrt(np.mean((rows["theta_simulated"] - rows["theta_measured"]) ** 2)))
    with browser.new_context(viewport={"width": 1440, "height": 900}) as context:
        page = opened(context.new_page(), folder)
        sentence = "theta is 52 mrad off after 0.2 s, and 0.2 rad over whole runs."
        assert " ".join(page.locator("h1").inner_text().split()) == sentence
        assert page.locator("#live-experiment option").first.inner_text() == simulation.worst
        before, now = errors(page)
        assert before == now == pytest.approx(error, rel=1e-6)
        slider(page, "b").press("Home")
        assert errors(page)[0] == before and errors(page)[1] != before
        page.get_by_role("button", name="As given").click()
        assert errors(page) == (before, before)
        assert page.get_by_role("button", name="As identified").count() == 0
        download = page.locator("#experiments a.button").get_attribute("href")
        assert str(download).startswith("data:text/csv;base64,")


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("width", [390, 1440])
def test_it_can_be_read(width: int, theme: Any, browser: Browser, folder: Path) -> None:
    check_readable(browser, folder, width, theme)


def test_names_stay_text(browser: Browser, simulation: um.Simulation, tmp_path: Path) -> None:
    ids = (EVIL, *simulation.logs.ids[1:])
    gap = simulation.gap
    each = dict(zip(ids, gap.per_experiment.values(), strict=True))
    floors = dict(zip(ids, gap.floors.values(), strict=True))
    evil = replace(
        simulation,
        system=replace(simulation.system, name=EVIL),
        logs=replace(simulation.logs, ids=ids),
        gap=replace(gap, per_experiment=each, floors=floors),
    )
    evil.save(tmp_path / "out")
    with browser.new_context(viewport={"width": 1440, "height": 900}) as context:
        page = opened(context.new_page(), tmp_path / "out")
        assert errors(page)[0] > 0.0
        assert EVIL in page.locator("#live-experiment option").all_inner_texts()
        assert page.evaluate("window.hacked === undefined && !document.querySelector('img[src=x]')")


def test_without_javascript_the_figure_is_there(browser: Browser, folder: Path) -> None:
    with browser.new_context(java_script_enabled=False) as context:
        page = context.new_page()
        page.goto((folder / "index.html").as_uri())
        assert not page.locator("#live-machine").is_visible()
        assert page.locator("figure img").is_visible()


@pytest.mark.long
def test_a_system_that_diverges_has_a_page(tmp_path: Path) -> None:
    system, logs = um.example("pendulum")
    b = next(p for p in system.parameters if p.name == "b")
    wild = um.simulate(system.with_values({"b": -50.0 * abs(b.value) - 10.0}), logs)
    wild.save(tmp_path / "out")
    text = (tmp_path / "out" / "index.html").read_text()
    assert "diverges" in re.search(r"<h1.*?>(.*?)</h1>", text, re.DOTALL)[1]  # type: ignore[index]
