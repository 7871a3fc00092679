"""Equations as pages show them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest

from pipeline.physics.system.equations import equations
from pipeline.physics.system.reader import read_system

SYSTEMS = sorted((Path(__file__).parents[3] / "systems").glob("*.yaml"))


@pytest.mark.parametrize("path", SYSTEMS, ids=lambda p: p.stem)
def test_every_equation_of_a_file_is_shown_as_mathml(path: Path) -> None:
    system = read_system(path)
    found = equations(system)
    assert [e.text for e in found if e.kind == "dynamics"] == [
        system.text[f"dynamics.{s.name}"] for s in system.states
    ]
    assert len([e for e in found if e.kind == "signal"]) == len(system.signals)
    for equation in found:
        ElementTree.fromstring(equation.mathml)


def test_signals_keep_their_names_and_derivatives_show() -> None:
    system = read_system(next(p for p in SYSTEMS if p.stem == "slider_crank"))
    ratio = next(e for e in equations(system) if e.text == "diff(d, theta)")
    letters = "".join(ElementTree.fromstring(ratio.mathml).itertext())
    assert letters.startswith("k=") and letters.endswith("d") and "l" not in letters


def test_what_was_not_written_is_not_shown() -> None:
    assert equations(replace(read_system(SYSTEMS[0]), text={})) == []
