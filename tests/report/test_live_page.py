"""The machine in the page of an answer: sliders, switches, plots, and names that stay text."""

import base64
import hashlib
import json
import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser, Locator, Page

from tests.browser import faults, opened
from tests.diagnosis.diagnoses import FRICTION, Said, diagnosis
from tests.diagnosis.studies import ANGLE
from tests.report.test_simulation_script import simulated
from unmodelled.base.files import write_json
from unmodelled.base.wording import clock, number
from unmodelled.diagnosis.answer.figure_tables import write_tables
from unmodelled.diagnosis.answer.live import write_live
from unmodelled.diagnosis.answer.summary import summary
from unmodelled.diagnosis.data.result import Diagnosis
from unmodelled.diagnosis.where.where import where
from unmodelled.report.diagnosis_page import write_page
from unmodelled.report.figures.files import write_figures

COMMAND = "python -m pipeline diagnose system=system.yaml logs=logs"
EVIL = (
    """</script><script>window.hacked=1</script><img src=x onerror="window.hacked=1">'"`${window.hacked=1}"""
)
LATE = Said("sensor_delay", ANGLE, {"T_d_theta": 0.003})


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Diagnosis:
    """Dry friction at the joint, and a delay of the sensor."""
    return diagnosis(tmp_path_factory.mktemp("case"), FRICTION, LATE)


@pytest.fixture(scope="module")
def answer(found: Diagnosis, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("answer")
    place = where(found)
    write_json(out / "diagnosis.json", summary(found, place))
    write_tables(found, place, out)
    write_live(found, out)
    write_figures(out)
    write_page(out, COMMAND)
    return out


@pytest.fixture
def page(browser: Browser, answer: Path) -> Iterator[Page]:
    with live(browser, answer) as page:
        yield page


@contextmanager
def live(browser: Browser, folder: Path, **options: Any) -> Iterator[Page]:
    """The page of a folder, as soon as its machine is drawn."""
    with opened(browser, folder / "index.html", **options) as page:
        page.locator("#live-machine .uplot").first.wait_for()
        yield page


def errors(page: Page) -> tuple[float, float]:
    """Root mean square errors as given and now, once what was asked for has been drawn."""
    page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    before, after = page.evaluate("Object.values({ ...document.querySelector('.live-status').dataset })")
    return float(before), float(after)


def slider(page: Page, name: str) -> Locator:
    return page.get_by_role("slider", name=name, exact=True)


def test_a_slider_moves_the_simulation_and_the_law(page: Page) -> None:
    before, after = errors(page)
    assert after < 0.9 * before
    law = "document.querySelectorAll('.live-plots [role=img]')[4].querySelector('canvas').toDataURL()"
    drawn, friction = page.evaluate(law), slider(page, "F_c")
    assert "inside the 95 % interval" in str(friction.get_attribute("aria-valuetext"))
    friction.focus()
    page.keyboard.press("Home")
    same, worse = errors(page)
    assert same == before and worse > 1.1 * after
    assert "outside" in str(friction.get_attribute("aria-valuetext"))
    assert page.evaluate(law) != drawn
    page.get_by_role("button", name="As identified").click()
    assert errors(page) == (before, after)


def test_the_missing_effort_is_shown_over_time(page: Page) -> None:
    plot = page.get_by_role("img", name="Coulomb friction at joint: missing tau over time")
    data = json.loads(page.locator("#live-data").text_content() or "")
    friction, late = data["effects"]
    assert late["missing"] is None and late["curve"] is None and plot.is_visible()
    for experiment in data["experiments"]:
        found = friction["missing"][experiment["id"]]
        assert len(found["at"]) == len(found["value"]) > 10
        assert max(found["at"]) < experiment["logged"]


def test_inputs_are_shown_beside_the_outputs(page: Page) -> None:
    data = json.loads(page.locator("#live-data").text_content() or "")
    for item in data["inputs"]:
        assert page.get_by_role("img", name=f"Input {item['name']} over time").is_visible()


def test_what_the_page_says_of_other_numbers_is_what_python_computes(page: Page, found: Diagnosis) -> None:
    for name, key in (("F_c", "PageDown"), ("T_d_theta", "Home"), ("b", "PageUp")):
        slider(page, name).press(key)
    F_c, late, b = (float(slider(page, name).input_value()) for name in ("F_c", "T_d_theta", "b"))
    assert F_c < 0.06 and late == 0.0 and b > 0.0151
    system = found.augmented.system.with_values({"F_c": F_c, "b": b})
    model = replace(found.augmented, system=replace(system, outputs=found.system.outputs))
    substeps = json.loads(page.locator("#live-data").text_content() or "")["substeps"]
    rows = found.logs.rows(1)
    for index, whole in enumerate((False, True)):
        page.locator("#live-mode").select_option(index=index)
        error = (simulated(found, model, substeps, whole) - found.logs.y)[rows]
        assert errors(page)[1] == pytest.approx(np.sqrt(np.nanmean(error**2)), rel=1e-9)


def test_times_and_large_numbers_read_as_in_python(page: Page) -> None:
    for seconds in (0.5, 119.0, 480.0, 12_000.0, 400_000.0):
        found = page.evaluate("s => format.clock(s)", seconds)
        assert (found["size"], found["unit"]) == clock(seconds)
    for value in (0.0, 9999.0, 12_000.0, -2_396_000.0, 0.05):
        assert page.evaluate("v => format.shown(v)", value) == number(value)


def test_a_switch_takes_an_effect_out(page: Page) -> None:
    before, after = errors(page)
    switch = page.get_by_role("switch", name="Coulomb friction at joint")
    switch.uncheck()
    _, without = errors(page)
    assert without > 1.1 * after and slider(page, "F_c").is_disabled()
    page.get_by_role("switch", name="sensor delay at sensor theta").uncheck()
    page.get_by_role("button", name="As given", exact=True).click()
    assert errors(page) == (before, before)
    for each in page.get_by_role("switch").all():
        assert not each.is_checked()
        each.check()
    _, again = errors(page)
    assert again < 0.9 * before


def test_experiments_and_whole_runs_can_be_chosen(page: Page) -> None:
    found = {errors(page)}
    names = page.locator("#live-experiment option").all_inner_texts()
    assert names == ["run1 (held out)", "run3 (held out)", "run0", "run2"]
    page.locator("#live-experiment").select_option("run2")
    found.add(errors(page))
    page.locator("#live-mode").select_option("the whole run")
    found.add(errors(page))
    assert len(found) == 3
    page.wait_for_timeout(300)
    assert page.locator(".live-status").inner_text().startswith("Root mean square error of theta in run2:")


def test_plots_zoom_together_and_stay_zoomed(page: Page) -> None:
    def ticks() -> list[str]:
        shots = page.locator(".live-plots [role=img] canvas").all()[:2]
        return [shot.evaluate("(canvas) => canvas.toDataURL()") for shot in shots]

    whole = ticks()
    page.get_by_role("button", name="Zoom in").click()
    near = ticks()
    assert near[0] != whole[0] and near[1] != whole[1]
    page.get_by_role("button", name="Whole experiment").click()
    assert ticks() == whole
    box = page.locator(".u-over").first.bounding_box()
    assert box
    page.mouse.move(box["x"] + 50, box["y"] + 40)
    for legend in page.locator(".u-legend").all()[:2]:  # both tell the values below the pointer
        assert "–" not in legend.inner_text()
    page.mouse.down()
    page.mouse.move(box["x"] + 150, box["y"] + 40)
    page.mouse.up()
    page.mouse.move(5, 5)
    dragged = ticks()
    assert dragged[1] not in (whole[1], near[1])


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("width", [390, 1440])
def test_the_page_can_be_read(width: int, theme: Any, browser: Browser, answer: Path) -> None:
    with live(browser, answer, viewport={"width": width, "height": 844}, color_scheme=theme) as page:
        assert not faults(page)
        for control in page.locator("#live-machine input, #live-machine select, #live-machine button").all():
            assert control.evaluate(
                "(e) => e.labels?.length || e.getAttribute('aria-label') || e.textContent"
            )


def test_only_the_scripts_of_the_page_run(answer: Path) -> None:
    text = (answer / "index.html").read_text()
    policy = unescape(re.search(r'http-equiv="Content-Security-Policy" content="([^"]+)"', text)[1])  # type: ignore[index]
    assert policy.startswith("default-src 'none'; script-src 'sha256-") and "unsafe-eval" not in policy
    scripts = re.findall(r"<script>(.*?)</script>", text, re.DOTALL)
    digests = {base64.b64encode(hashlib.sha256(s.encode()).digest()).decode() for s in scripts}
    assert set(re.findall(r"'sha256-([^']+)'", policy)) == digests and len(digests) == 8
    assert "Permission is hereby granted" in text
    assert len(text) < 4e6


def test_names_stay_text(browser: Browser, answer: Path, tmp_path: Path) -> None:
    shutil.copytree(answer, tmp_path, dirs_exist_ok=True)
    for name in ("diagnosis.json", "tables/about.json", "tables/live.json"):
        path = tmp_path / name
        text = re.sub(r'"(run1|theta was unwrapped)"', lambda _: json.dumps(EVIL), path.read_text())
        named = r'"(name|system)": ?"(theta|torque|pendulum|F_c)"'
        path.write_text(re.sub(named, lambda m: f'"{m[1]}":{json.dumps(EVIL)}', text))
    write_page(tmp_path, COMMAND)
    with live(browser, tmp_path) as page:
        assert errors(page)[0] > 0.0
        assert page.locator("#live-experiment option").first.inner_text() == f"{EVIL} (held out)"
        assert page.get_by_role("slider", name=EVIL).count() == 1
        assert page.evaluate("window.hacked === undefined && !document.querySelector('img[src=x]')")
        # the bar at the top ends a long name with an ellipsis
        assert not [what for what in faults(page, "overflows") if "SPAN.name" not in what]


@pytest.mark.long
def test_without_javascript_the_figures_are_there(browser: Browser, answer: Path) -> None:
    with opened(browser, answer / "index.html", java_script_enabled=False) as page:
        assert not page.locator("#live-machine").is_visible()
        assert page.locator("noscript").inner_text().startswith("The machine runs in this page by JavaScript")
        assert (
            page.locator(".drawing svg.wide").is_visible()
            and page.locator("#before_and_after img").is_visible()
        )
