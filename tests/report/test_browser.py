"""The report in Chromium: every page opens, nothing is dead or cut off, and what can be clicked works.

REPORT_SITE=<folder> visits a report that was built before instead of a small one that is made here.
REPORT_SCREENSHOTS=<folder> keeps pictures of all pages.
"""

import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

import pandas as pd
import pytest
from playwright.sync_api import Browser, Page

from tests.browser import CHECKS, DESKTOP, faults, watched
from tests.report import case
from unmodelled.report.diagnosis_page import write_page

COMMAND = "python -m pipeline diagnose system=systems/emps.yaml logs=logs"


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A report with every kind of page, and a diagnosis page of its own beside it."""
    if given := os.environ.get("REPORT_SITE"):
        return Path(given).resolve()
    inputs, out = case.write_inputs(tmp_path_factory.mktemp("inputs")), tmp_path_factory.mktemp("reports")
    case.put(inputs / "bench" / "claims.json", [case.claim(id=f"c{k}", **c) for k, c in enumerate(CLAIMS)])
    case.put(inputs / "bench" / "equations.json", case.formula(FRACTION))
    case.put(inputs / "tables" / "wide.csv", WIDE)
    case.put(inputs / "tables" / "wide.json", {"title": f"Wide {case.LONG}", "chapter": 6, "data": "virtual"})
    advice = {"value": 2, "unit": "sentences", "text": ["m3 and l1 must be separated", "hold m1 fixed"]}
    case.put(inputs / "metrics" / "chapter3.json", {**case.HEAD, "advice": advice, case.LONG: case.LEAF})
    for machine in ("emps", "cam_drivetrain"):
        about = {"data": "measured", "description": f"recordings of {case.LONG}", "experiments": 16}
        case.put(inputs / "raw" / machine / "provenance.json", about)
        case.write_diagnosis(inputs / "diagnoses" / "real" / machine / "coulomb_withheld", machine)
        write_page(inputs / "diagnoses" / "real" / machine / "coulomb_withheld", COMMAND)
    for k, stage in enumerate(("acquire", "train@a", "train@b", "evaluate@a", "evaluate@b", "draw", "site")):
        case.put(inputs / "executions" / f"{stage}.json", case.execution(stage, seconds=10.0 * k + 1))
    case.make(inputs, out)
    shutil.copytree(inputs / "diagnoses" / "real" / "emps" / "coulomb_withheld", out / "alone")
    return out


PROTOCOL = (
    "trained on the most stable tenth, free run from the measured initial state, median over runs. " * 4
)
LISTED = {"ours": "f_bb 46.73, f_h1 287.81, f_h2 319.03", "interval": None, "unit": "(rad/s)^2"}
CLAIMS = [
    {"protocol": PROTOCOL, "ours": 3.0},
    {"verdict": "does not hold", "claim": f"{case.LONG} fails", "ours": 20.0},
    {"verdict": "holds in direction", "chapter": 3, **LISTED},
    {"verdict": "too few repeats", "chapter": 3},
    {"verdict": "cannot be tested on these data", "chapter": 4, "ours": None, "interval": None},
    {"unit": "lower, share", "ours": 0.583, "interval": [0.568, 0.609], "dissertation": 0.42, "chapter": 5},
    {"unit": "higher, share (median over data sets)", "ours": 1e-4, "interval": [-0.2, 0.3]},
    {"data": "measured", "page": 98, "chapter": 3},
]
FRACTION = (
    '<math display="block"><mrow><mover><mi>v</mi><mo>.</mo></mover><mo>=</mo><mfrac><mrow><mi>F</mi></mrow>'
    "<mrow><mi>m</mi></mrow></mfrac>" + "<mo>+</mo><mi>x</mi>" * 60 + "</mrow></math>"
)
NUMBERS = [[(7 * k + 3 * j) % 11 - 4.5 for k in range(14)] for j in range(40)]
WIDE = pd.DataFrame(NUMBERS, columns=[f"column_{k}" for k in range(14)]).to_csv(index=False)


def files(built: Path) -> list[Path]:
    return [built / "index.html", *sorted(built.glob("*/**/*.html"))]


def screenshot(page: Page, built: Path, file: Path, name: str) -> None:
    if folder := os.environ.get("REPORT_SCREENSHOTS"):
        page_name = "_".join(file.relative_to(built).with_suffix("").parts)
        page.screenshot(path=Path(folder) / f"{page_name}_{name}.png", full_page=True)


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("width", [375, 1440])
def test_every_page_opens_and_can_be_read(width: int, theme: Any, browser: Browser, built: Path) -> None:
    with browser.new_context(viewport={"width": width, "height": 900}, color_scheme=theme) as context:
        page = context.new_page()
        wrong = watched(page)
        for file in files(built):
            page.goto(file.as_uri())
            wrong += [f"{file.name}: {what}" for what in [*faults(page), *faults(page, "commands")]]
            screenshot(page, built, file, f"{width}_{theme}")
    assert not wrong, "\n".join(wrong)


def test_no_link_is_dead(browser: Browser, built: Path) -> None:
    links: dict[Path, list[str]] = {}
    ids: dict[Path, set[str]] = {}
    with browser.new_context() as context:
        page = context.new_page()
        page.add_init_script(CHECKS)
        for file in files(built):
            page.goto(file.as_uri())
            links[file], ids[file] = page.evaluate("checks.links()"), set(page.evaluate("checks.ids()"))
    dead = set()
    for file, urls in links.items():
        for url in urls:
            parts = urlsplit(url)
            target = Path(unquote(parts.path))
            if parts.scheme != "file" or not target.is_file():
                dead.add(f"{file.name}: {url}")
            elif parts.fragment and unquote(parts.fragment) not in ids[target]:
                dead.add(f"{file.name}: {url} has no such place")
    assert sum(map(len, links.values())) > 100 and not dead, "\n".join(sorted(dead))


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    with browser.new_context(viewport=DESKTOP) as context:
        yield context.new_page()


def test_the_search_finds_a_figure(page: Page, built: Path) -> None:
    page.goto((built / "index.html").as_uri())
    page.keyboard.press("/")
    page.keyboard.type("figure 6.20")
    assert page.locator("#found a").first.inner_text().startswith("Figure 6.20")
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    page.wait_for_url("**/chapter_6.html#fig_6_20")
    assert page.locator("#fig_6_20 img").is_visible()
    page.fill("#search", "no such thing anywhere")
    assert page.locator("#found").inner_text() == "Nothing found."


def numbers(page: Page, table: str, column: int) -> list[float]:
    cells = page.locator(f"#{table} tbody tr:visible td:nth-child({column})")
    return [float(cell.get_attribute("data-exact") or cell.inner_text()) for cell in cells.all()]


def test_a_table_sorts_filters_and_is_saved(page: Page, built: Path, tmp_path: Path) -> None:
    page.goto((built / "site" / "runs.html").as_uri())
    before = numbers(page, "stages", 3)
    heading = page.locator("#stages th", has_text="Time")
    heading.get_by_role("button").click()
    assert numbers(page, "stages", 3) == sorted(before) != before
    assert heading.get_attribute("aria-sort") == "ascending"
    heading.get_by_role("button").click()
    assert numbers(page, "stages", 3) == sorted(before, reverse=True)
    page.fill("#executions [data-filter]", "train@")
    rows = page.locator("#executions tbody tr:visible").all()
    assert rows and all("train@" in row.inner_text() for row in rows)
    assert page.locator("#executions .count").inner_text().startswith(f"{len(rows)} of ")
    with page.expect_download() as download:
        page.locator("#stages a.button").click()
    download.value.save_as(tmp_path / "stages.csv")
    assert (tmp_path / "stages.csv").read_text() == (built / "site" / "tables" / "stages.csv").read_text()


def test_a_verdict_shows_its_claims(page: Page, built: Path) -> None:
    page.goto((built / "index.html").as_uri())
    rows = page.locator("#claims-index tbody tr:visible")
    everything = rows.count()
    tile = page.locator("[data-show=fails]")
    tile.click()
    assert rows.count() == int(tile.locator("strong").inner_text()) < everything
    assert set(rows.locator("td.verdict").all_inner_texts()) == {"does not hold"}
    tile.click()
    assert rows.count() == everything


@pytest.mark.parametrize("width", [375, 1440])
def test_a_figure_enlarges(width: int, page: Page, built: Path) -> None:
    page.set_viewport_size({"width": width, "height": 800})
    page.goto((built / "site" / "chapter_6.html").as_uri())
    plate, dialog = page.locator("#fig_6_20 .plate"), page.locator("#zoom")
    plate.click()
    assert dialog.is_visible() and dialog.locator("strong").inner_text() == "Figure 6.20"
    small, large = plate.locator("img").bounding_box(), dialog.locator("img").bounding_box()
    assert small and large and large["width"] > 1.2 * small["width"]
    page.keyboard.press("ArrowRight")
    assert dialog.locator("strong").inner_text() != "Figure 6.20"
    page.keyboard.press("Escape")
    assert not dialog.is_visible()


def test_light_and_dark_are_kept_from_page_to_page(page: Page, built: Path) -> None:
    def ground() -> str:
        return str(page.evaluate("getComputedStyle(document.body).backgroundColor"))

    page.goto((built / "index.html").as_uri())
    light = ground()
    page.click("#theme")
    assert ground() != light
    page.goto((built / "site" / "runs.html").as_uri())
    assert ground() != light


@pytest.mark.long
def test_equations_are_typeset(page: Page, built: Path) -> None:
    chapter = next(file for file in files(built) if "<mfrac>" in file.read_text())
    page.goto(chapter.as_uri())
    above, below = (page.locator("mfrac").first.locator(f"> :nth-child({k})").bounding_box() for k in (1, 2))
    assert above and below and above["y"] + above["height"] <= below["y"] + 1
