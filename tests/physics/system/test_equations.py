"""Equations as pages show them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest

from unmodelled.systems.equations import equations
from unmodelled.systems.operations import FUNCTIONS
from unmodelled.systems.reader import read_system

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


SHOWN = {
    "asin": "arcsin(x)",
    "atan": "arctan(x)",
    "acos": "arccos(x)",
    "atan2": "arctan(x,y)",
    "exp": "ⅇx",
    "sqrt": "x",
    "abs": "|x|",
    "mod": "(x-y\u2062floor(xy))",
    "clip": "min(max(x,y),z)",
    "where": "where(x,y,z)",
}


def shown(expression: str, folder: Path) -> str:
    """The letters of an expression of three states and a table."""
    (folder / "points.csv").write_text("a,b\n0,0\n1,1\n2,4\n3,9\n")
    (folder / "three.yaml").write_text(f"""
schema: system/1
name: three
states: {{x: {{unit: "1"}}, y: {{unit: "1"}}, z: {{unit: "1"}}}}
outputs: {{x: {{unit: "1"}}}}
parameters: {{k: {{value: 2.0, unit: 1/s}}}}
tables: {{curve: {{file: points.csv, x: a, y: b}}}}
dynamics: {{x: "k*({expression})", y: 0*k, z: 0*k}}
""")
    found = equations(read_system(folder / "three.yaml"))[0]
    letters = "".join(ElementTree.fromstring(found.mathml).itertext())
    return letters.removeprefix("x˙=").replace("k\u2062", "")


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_function_shows_with_its_arguments(name: str, tmp_path: Path) -> None:
    arguments = "x,y,z"[: 2 * FUNCTIONS[name].least - 1]
    assert shown(f"{name}({arguments})", tmp_path) == SHOWN.get(name, f"{name}({arguments})")


@pytest.mark.parametrize(
    ("expression", "letters"),
    [
        ("where(x > y, y, z)", "where((x>y),y,z)"),
        ("where(x <= y, y, z)", "where((y≥x),y,z)"),
        ("where(x != y, y, z)", "where(1-(x=y),y,z)"),
        ("diff(y*curve(x), x)", "y\u2062curve′(x)"),
        ("cos(x)*sign(x)", "cos(x)\u2062sign(x)"),
    ],
)
def test_comparisons_and_tables_show_as_they_are_meant(expression: str, letters: str, tmp_path: Path) -> None:
    assert shown(expression, tmp_path) == letters


def test_what_was_not_written_is_not_shown() -> None:
    assert equations(replace(read_system(SYSTEMS[0]), text={})) == []
