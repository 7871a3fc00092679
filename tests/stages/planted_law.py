"""A law of the library planted in a small machine and diagnosed from its logs to the page: what must hold."""

from collections.abc import Callable, Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from playwright.sync_api import Browser

from pipeline.__main__ import main
from tests.browser import DESKTOP, faults, watched
from tests.diagnosis.planted import plant, with_companions
from tests.report.case import Page
from tests.report.test_site import check_addresses
from unmodelled.base.files import read_json
from unmodelled.diagnosis.answer.augmented import FILE
from unmodelled.diagnosis.columns import columns
from unmodelled.diagnosis.fitting.free_runs import free_runs
from unmodelled.effects.effect import Effect, PortEffect
from unmodelled.effects.library import effects
from unmodelled.logs.folder import read_logs
from unmodelled.report.figures.files import figures_of
from unmodelled.report.formula import formula
from unmodelled.systems.reader import read_system

#: Diagnoses one of the laws and returns the folder with system.yaml, logs and out.
Diagnosed = Callable[[str], Path]


def laws() -> dict[str, Effect]:
    """All laws by family and variant."""
    return {" ".join(filter(None, (e.family, e.variant))): e for e in effects()}


def along_travel(effect: Effect) -> bool:
    """Whether the law depends on a position: about half of all do."""
    return isinstance(effect, PortEffect) and "position" in effect.needs


def diagnosing(root: Path, alone: bool = True, ids: Sequence[str] | None = None) -> Iterator[Diagnosed]:
    """A function that plants a law and runs the command line, once for each law.

    `alone`: the search looks at this law only, and at one that it needs beside it, in a tenth of the time.
    """
    with pytest.MonkeyPatch.context() as patch:

        @cache
        def diagnosed(name: str) -> Path:
            folder, effect = root / name.replace(" ", "-"), laws()[name]
            plant(folder, effect, ids)
            if alone:
                patch.setattr(columns, "effects", lambda: with_companions(effect))
            given = {key: folder / place for key, place in GIVEN.items()}
            assert main(["diagnose", *(f"{key}='{path}'" for key, path in given.items()), "-q"]) == 0
            return folder

        yield diagnosed


GIVEN = {"system": "system.yaml", "logs": "logs", "out": "out"}


def check_answer(folder: Path) -> dict[str, Any]:
    """The file says what diagnosis.json says; nothing is lost and nothing diverges. Return diagnosis.json."""
    content: dict[str, Any] = read_json(folder / "out" / "diagnosis.json")
    assert not [note for note in content["notes"] if "could not" in note or "diverges" in note]
    if any(row["file"] == FILE for row in content["refused"]):  # the error is noise without the effect, too
        assert content["gap"]["known"] < 1.1 * content["gap"]["floor"]
        return content
    system = read_system(folder / "out" / FILE)
    logs = read_logs(folder / "logs", system)
    found = free_runs(system, logs, content["gap"]["horizon"]).value
    # without an experiment in the fit, its error is larger
    assert found <= (1.0 + 1e-6) * content["gap"]["augmented"] < content["gap"]["known"]
    return content


def check_page(folder: Path) -> None:
    """The page has all equations of every law and all figures, which are well-formed."""
    out = folder / "out"
    text, content = (out / "index.html").read_text(), read_json(out / "diagnosis.json")
    check_addresses(out, {"index.html": text})
    images = [a for a in Page(text).addresses if a.startswith("data:image/svg+xml;base64,")]
    drawn = list(figures_of(out))
    assert [row["id"] for row in read_json(out / "figures" / "figures.json")] == drawn
    assert len(images) == len(drawn)
    for name in drawn:
        ElementTree.parse(out / "figures" / f"{name}.svg")
    for effect in content["effects"]:
        shown = ElementTree.fromstring(f"<div>{formula(effect['law'])}</div>")
        assert len(shown) == 1 + effect["law"].count(" = ") + effect["law"].count(" <= ")
        # the first line has what the law is equal to before it
        first, *others = (ElementTree.tostring(row, encoding="unicode") for row in shown)
        assert all(row in text for row in others)
        assert f"<mo>=</mo>{first.partition('<mrow>')[2]}" in text


@pytest.fixture(scope="module")
def diagnosed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Diagnosed]:
    yield from diagnosing(tmp_path_factory.mktemp("laws"))


def check_law(name: str, diagnosed: Diagnosed) -> None:
    """A planted law is told, with the one that it needs beside it, and its answer is whole.

    It is named, or cannot be told from what is named, or is a usual part of the measurement chain.
    """
    folder = diagnosed(name)
    content = check_answer(folder)
    alike = [each for effect in content["effects"] for each in (effect, *effect["indistinguishable"])]
    told = {each["family"] for each in (*alike, *content.get("chain", ()))}
    assert told >= {each.family for each in with_companions(laws()[name])}
    check_page(folder)


def check_in_browser(browser: Browser, folders: list[Path]) -> None:
    """Every page opens without a fault, and everything on it can be seen."""
    with browser.new_context(viewport=DESKTOP) as context:
        page = context.new_page()
        wrong = watched(page)
        for folder in folders:
            page.goto((folder / "out" / "index.html").as_uri())
            wrong += [f"{folder}: {what}" for what in faults(page)]
            named = read_json(folder / "out" / "diagnosis.json")["effects"]
            assert bool(page.locator(".effect math").count()) == bool(named), folder
    assert not wrong, "\n".join(wrong)
