"""The list of answers: all are found, damaged ones are notes, and the page filters, sorts and compares."""

import json
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import pandas as pd
import pytest
from playwright.sync_api import Browser, Page

from tests.browser import faults, opened
from tests.report import case
from unmodelled import list_answers
from unmodelled.__main__ import PROGRAM
from unmodelled.base.errors import BadInput
from unmodelled.base.tables import write_table
from unmodelled.cli.command_line import main
from unmodelled.report.diagnosis_page import write_page

EVIL = "<script>alert('x')</script>"
NOWHERE: dict[str, Any] = {"channels": [], "regions": [], "factors": [], "experiments": []}


def put(folder: Path, **changes: Any) -> None:
    """An answer with some entries of diagnosis.json changed, without its page."""
    case.write_diagnosis(folder)
    content = json.loads((folder / "diagnosis.json").read_text())
    case.put(folder / "diagnosis.json", content | changes)


def friction(low: float, high: float) -> dict[str, Any]:
    """Coulomb friction at the rail with an interval, N."""
    number = {"value": (low + high) / 2.0, "unit": "N", "interval": [low, high]}
    return {**case.FRICTION, "parameters": {"F_c": number}, "indistinguishable": []}


@pytest.fixture(scope="module")
def answers(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four answers, one of them with its page, and two files that are no answers."""
    folder = tmp_path_factory.mktemp("machines")
    put(folder / "stage" / "before", effects=[friction(22.0, 23.0)])
    write_page(folder / "stage" / "before", "unmodelled diagnose")
    times = pd.DataFrame({"over": "experiment", "t": [0.1, 0.2, 0.3], "reidentified": [1.0, 3.0, 2.0]})
    write_table(times.assign(augmented=0.1), folder / "stage" / "before" / "tables" / "time")
    put(folder / "stage" / "after #2", effects=[friction(18.0, 19.0)])
    same = dict.fromkeys(("known", "reidentified", "augmented", "neural", "floor", "persistence"), 0.02)
    gap = {**same, "shrink": 0.0, "interval": [0.0, 0.0], "held_out": [], "horizon": 0.1, "units": {}}
    put(folder / "none", verdict="no_gap", effects=[], where=NOWHERE, gap=gap, system=EVIL)
    put(folder / "logs", verdict="check_logs", effects=[], parameters={})
    case.put(folder / "torn" / "diagnosis.json", "{")
    case.put(folder / "odd" / "diagnosis.json", {"schema": "diagnosis/2", "verdict": "effect"})
    case.put(folder / ".hidden" / "diagnosis.json", "{")
    return folder


@pytest.fixture(scope="module")
def page_file(answers: Path) -> Path:
    return list_answers(answers).save()


def test_every_answer_is_listed_and_what_is_none_is_a_note(answers: Path) -> None:
    found = list_answers(answers)
    table = found.table().set_index("answer")
    assert list(table.index) == ["logs", "none", "stage/after #2", "stage/before"]
    assert table.loc["stage/before", "effects"] == "Coulomb friction at rail"
    assert table.loc["stage/before", "place"] == "rail, 96\u202f%"
    assert table.loc["stage/before", "known"] == 0.31 and pd.isna(table.loc["logs", "augmented"])
    assert [note.split(":")[0] for note in found.notes] == [
        str(answers / name / "diagnosis.json") for name in ("odd", "torn")
    ]
    assert "system is missing" in found.notes[0] and "not a JSON file" in found.notes[1]
    (line,) = (line for line in repr(found).splitlines() if line.startswith("stage/before"))
    for part in ("effect found", "14\xa0mm", "0.2\xa0mm", "Coulomb friction at rail: 22.5 N (22.0 to 23.0)"):
        assert part in line


def test_the_page_loads_nothing_and_escapes_names(page_file: Path) -> None:
    text = page_file.read_text()
    assert EVIL not in text and "&lt;script&gt;alert" in text
    assert "default-src &#39;none&#39;" in text and "https://" not in text
    links = re.findall(r'<td data-label="Answer"[^>]*>.*?<a href="([^"]+)"', text)
    assert [(page_file.parent / unquote(link)).is_file() for link in links] == [True]
    assert text.count('<svg class="spark"') == 1 and "root mean square 2.2 before and 0.1 after" in text


def test_the_verb_lists_a_folder(answers: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(PROGRAM, ["report", str(answers), f"out={tmp_path / 'list'}"]) == 0
    said = capsys.readouterr().out
    assert "stage/before" in said and "note: " in said and f"open {tmp_path / 'list' / 'index.html'}" in said
    (link,) = re.findall(r'href="([^"]+before/index\.html)"', (tmp_path / "list" / "index.html").read_text())
    assert (tmp_path / "list" / unquote(link)).resolve() == answers / "stage" / "before" / "index.html"


def test_nothing_to_list_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "empty").mkdir()
    for name, said in (("empty", "holds no answer"), ("absent", "is no folder")):
        with pytest.raises(SystemExit) as left:
            main(PROGRAM, ["report", str(tmp_path / name)])
        error = capsys.readouterr().err
        assert left.value.code == 2 and said in error and error.count("\n") == 1
        assert not (tmp_path / name / "index.html").exists()


def test_another_page_is_kept(answers: Path) -> None:
    page = answers / "stage" / "before" / "index.html"
    before = page.read_text()
    with pytest.raises(BadInput, match="was not made by report"):
        list_answers(page.parent).save()
    assert page.read_text() == before


def number_of(digits: int) -> dict[str, Any]:
    """A gap that no float holds, in a file that is JSON all the same."""
    return {"known": 10**digits, "reidentified": 0.02, "augmented": 0.02, "floor": 0.02, "units": {}}


ODD: dict[str, dict[str, Any]] = {
    "a number of 400 digits": {"gap": number_of(400)},
    "a text as a number": {"confidence": "high"},
    "a list as an effect": {"effects": [[1, 2]]},
    "a mapping as a verdict": {"verdict": {"effect": 1}},
    "an effect without numbers": {"effects": [{"family": "coulomb_friction"}]},
}


@pytest.mark.parametrize("name", ODD)
def test_one_damaged_answer_does_not_stop_the_list(name: str, tmp_path: Path) -> None:
    put(tmp_path / "crane")
    put(tmp_path / "damaged", **ODD[name])
    found = list_answers(tmp_path)
    assert [one.name for one in found.answers] == ["crane"]
    (note,) = found.notes
    assert note.startswith(f"{tmp_path / 'damaged' / 'diagnosis.json'}: ") and found.save().exists()


def test_names_send_no_commands_to_the_terminal(
    tmp_path: Path, capsysbinary: pytest.CaptureFixture[bytes]
) -> None:
    """A folder name that is not UTF-8, one with a control character, and texts of an edited answer."""
    command = "\x1b]0;pwn\x07"
    put(tmp_path / os.fsdecode(b"mill\xff"), system=f"lathe{command}")
    put(tmp_path / f"saw{command}", effects=[friction(22.0, 23.0) | {"port": f"rail{command}"}])
    write_page(tmp_path / f"saw{command}", "unmodelled diagnose")
    assert main(PROGRAM, ["report", str(tmp_path)]) == 0
    said = b"".join(capsysbinary.readouterr())
    assert b"\x1b" not in said and b"mill\\udcff" in said and b"saw\\x1b]0;pwn\\x07" in said
    (link,) = re.findall(r'href="([^"]+/index\.html)"', (tmp_path / "index.html").read_text())
    assert (tmp_path / unquote(link)).is_file()


@pytest.mark.parametrize("kind", ["pipe", "folder", "page of a user"])
def test_a_place_that_is_no_list_is_refused_at_once(kind: str, tmp_path: Path) -> None:
    put(tmp_path / "crane")
    page = tmp_path / "index.html"
    if kind == "pipe":
        os.mkfifo(page)
    elif kind == "folder":
        page.mkdir()
    else:
        page.write_text("<html>mine</html>")
    with pytest.raises(BadInput, match=r"index.html: (is a named pipe|cannot be replaced|was not made by)"):
        list_answers(tmp_path).save()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["crane", "index.html"]


@pytest.fixture
def page(browser: Browser, page_file: Path) -> Iterator[Page]:
    with opened(browser, page_file) as page:
        yield page


def shown(page: Page) -> list[str]:
    cells = page.locator("#answers tbody tr:visible td:first-child").all()
    return [str(cell.get_attribute("data-exact")) for cell in cells]


def test_answers_are_filtered_and_sorted(page: Page) -> None:
    everything = shown(page)
    page.locator("[data-show=holds]").click()
    assert shown(page) == ["stage/after #2", "stage/before"]
    page.fill("#answers [data-filter]", "before")
    assert shown(page) == ["stage/before"]
    page.fill("#answers [data-filter]", "")
    page.locator("[data-show=holds]").click()
    assert shown(page) == everything
    page.locator("#answers th", has_text="Error before").get_by_role("button").click()
    assert shown(page)[0] == "none"


def test_two_answers_are_compared(page: Page) -> None:
    for name in ("logs", "stage/after #2", "stage/before"):
        page.get_by_label(f"Compare {name}", exact=True).press("Space")
    assert not page.get_by_label("Compare logs", exact=True).is_checked()
    assert page.locator("#compared thead th").all_inner_texts()[1:3] == ["stage/after #2", "stage/before"]
    (apart,) = page.locator("#compared tr.apart").all()
    assert apart.locator("th").inner_text() == "F_c of Coulomb friction at rail (N)"
    assert apart.locator("td").all_inner_texts()[:2] == ["18.5 N (18.0 to 19.0)", "22.5 N (22.0 to 23.0)"]
    page.get_by_label("Compare stage/before", exact=True).press("Space")
    assert page.locator("#compared table").count() == 0


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("width", [390, 1440])
def test_the_page_can_be_read(width: int, theme: Any, page: Page) -> None:
    page.set_viewport_size({"width": width, "height": 900})
    page.emulate_media(color_scheme=theme)
    for box in page.locator("[data-answer]").all()[-2:]:
        box.check()
    assert not faults(page, "overflows", "illegible")


@pytest.mark.long
def test_without_javascript_it_is_a_table(browser: Browser, page_file: Path) -> None:
    with opened(browser, page_file, java_script_enabled=False) as plain:
        assert len(shown(plain)) == 4 and not plain.locator("[data-answer]").first.is_visible()
        assert plain.locator("noscript").inner_text().startswith("JavaScript is switched off")
