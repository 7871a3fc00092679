"""Pages of a simulation, a training and a distribution: sentence, machine, names that stay text."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from playwright.sync_api import Browser

import unmodelled as um
from tests.browser import faults, opened
from tests.report.test_live_page import EVIL, errors, live, slider
from unmodelled.api.uncertainty_page import write_page
from unmodelled.uncertainty.response import Formula


@pytest.fixture(scope="module")
def simulation() -> um.Simulation:
    return um.simulate(*um.example("pendulum"))


@pytest.fixture(scope="module")
def learned() -> um.LearnedLaws:
    system, logs = um.example("pendulum")
    return um.learned_laws(um.train(system, logs, um.one_per_port(hidden=32)), logs)


@pytest.fixture(scope="module")
def simulated(simulation: um.Simulation, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("simulation") / "out"
    simulation.save(out)
    return out


@pytest.fixture(scope="module")
def trained(learned: um.LearnedLaws, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("training") / "out"
    learned.fit.save(out)
    learned.save(out)
    return out


@pytest.fixture(scope="module")
def identified(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("uncertainty") / "out"
    found = um.identify_uncertainty(*um.example("flywheel"), data_sets=4)
    found.save(out)
    write_page(found, out, *um.example("flywheel"))
    return out


def error_of(simulation: um.Simulation) -> float:
    """Root mean square error of the angle in the worst experiment; the first sample is no prediction."""
    table = simulation.table()
    rows = table[table["experiment"] == simulation.worst][1:]
    return float(np.sqrt(np.mean((rows["theta_simulated"] - rows["theta_measured"]) ** 2)))


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("width", [390, 1440])
@pytest.mark.parametrize(
    "folder", ["simulated", pytest.param("trained", marks=pytest.mark.long), "identified"]
)
def test_it_can_be_read(
    folder: str, width: int, theme: Any, browser: Browser, request: pytest.FixtureRequest
) -> None:
    shown = {"viewport": {"width": width, "height": 844}, "color_scheme": theme}
    with live(browser, request.getfixturevalue(folder), **shown) as page:
        assert not faults(page)


def test_a_simulation_says_how_far_off_the_model_is_and_follows_its_sliders(
    browser: Browser, simulated: Path, simulation: um.Simulation
) -> None:
    with live(browser, simulated) as page:
        sentence = "theta is 52 mrad off after 0.2 s, and 0.2 rad over whole runs."
        assert " ".join(page.locator("h1").inner_text().split()) == sentence
        assert page.locator("#live-experiment option").first.inner_text() == simulation.worst
        before, now = errors(page)
        assert before == now == pytest.approx(error_of(simulation), rel=1e-6)
        slider(page, "b").press("Home")
        assert errors(page)[0] == before and errors(page)[1] != before
        page.get_by_role("button", name="As given").click()
        assert errors(page) == (before, before)
        assert page.get_by_role("button", name="As identified").count() == 0
        download = page.locator("#experiments a.button").get_attribute("href")
        assert str(download).startswith("data:text/csv;base64,")


@pytest.mark.long
def test_a_training_says_what_was_learned_and_follows_the_coefficients(
    browser: Browser, trained: Path, learned: um.LearnedLaws
) -> None:
    with live(browser, trained) as page:
        sentence = " ".join(page.locator("h1").inner_text().split())
        assert sentence.startswith("The networks have learned an effort of up to 0.1")
        assert sentence.endswith("mrad instead of 52 mrad.")
        assert page.locator(".effect math").count() == 1
        before, now = errors(page)
        assert before == now == pytest.approx(error_of(learned.simulation), rel=1e-6)
        slider(page, "joint_c1").press("Home")
        assert errors(page)[0] == before and errors(page)[1] != before


def test_a_distribution_says_what_scatters_and_has_the_machine(browser: Browser, identified: Path) -> None:
    with live(browser, identified) as page:
        sentence = " ".join(page.locator("h1").inner_text().split())
        assert sentence.startswith("T_b: mean 0.884 (0.84 to 0.922), standard deviation 0.0928 (0.07")
        assert sentence.endswith("in multiples of the system file, from 24 observations.")
        assert page.locator("#estimates tbody tr").count() == 6
        # the means are lower than the file's value, and predict the times better
        before, now = errors(page)
        assert before != now
        slider(page, "T_b").press("Home")
        assert errors(page)[0] == before and errors(page)[1] != now


def test_names_of_a_simulation_stay_text(browser: Browser, simulation: um.Simulation, tmp_path: Path) -> None:
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
    with live(browser, tmp_path / "out") as page:
        assert errors(page)[0] > 0.0
        assert EVIL in page.locator("#live-experiment option").all_inner_texts()
        assert page.evaluate("window.hacked === undefined && !document.querySelector('img[src=x]')")


@pytest.mark.long
def test_names_of_a_training_stay_text(browser: Browser, learned: um.LearnedLaws, tmp_path: Path) -> None:
    evil = replace(learned, laws=tuple(replace(law, network=EVIL) for law in learned.laws), notes=(EVIL,))
    learned.fit.save(tmp_path / "out")
    evil.save(tmp_path / "out")
    with live(browser, tmp_path / "out") as page:
        assert EVIL in page.locator(".notes li").all_inner_texts()
        assert page.evaluate("window.hacked === undefined && !document.querySelector('img[src=x]')")


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
    with opened(browser, tmp_path / "out" / "index.html") as page:
        assert page.locator("#live-machine").count() == 0
        assert EVIL in page.locator(".notes li").all_inner_texts()
        assert page.evaluate("window.hacked === undefined && !document.querySelector('img[src=x]')")


def test_without_javascript_the_figure_is_there(browser: Browser, simulated: Path) -> None:
    with opened(browser, simulated / "index.html", java_script_enabled=False) as page:
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
