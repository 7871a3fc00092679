"""The load of a port: what the file names, or the effort of the inputs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
import sympy as sp

from tests.physics.effects.benches import measured
from unmodelled.effects.library import effects
from unmodelled.effects.load import load
from unmodelled.systems.grammar import parse
from unmodelled.systems.model import System
from unmodelled.systems.reader import read_system
from unmodelled.systems.scope import scope_of
from unmodelled.systems.writer import write_system

SYSTEMS = Path(__file__).parents[3] / "systems"


def system(name: str) -> System:
    return read_system(SYSTEMS / name)


@pytest.mark.parametrize(
    ("file", "port", "text"),
    [
        ("withheld/hoist.yaml", "rail", "kf*u"),
        ("withheld/belt_axis.yaml", "motor", "i*kf"),
        ("withheld/pendulum.yaml", "joint", "torque"),
        ("xl330/load_withheld.yaml", "horn", "tau_m"),
        ("so101/friction_withheld.yaml", "joint", "clip(k_p*(goal - q), -tau_max, tau_max)"),
    ],
)
def test_the_load_is_the_effort_of_the_inputs(file: str, port: str, text: str) -> None:
    known = system(file)
    found = load(known, known.port(port))
    assert found is not None and found[0] == text
    assert found[1].free_symbols & {*known.u}


def test_terms_without_inputs_are_no_load_and_signs_do_not_matter() -> None:
    hoist = system("withheld/hoist.yaml")
    turned = replace(hoist, dynamics=tuple(-f for f in hoist.dynamics))
    for known in (hoist, turned):
        found = load(known, known.port("rail"))
        assert found is not None and found[1] == sp.Mul(*sp.symbols("kf u", real=True))


def test_a_port_that_no_input_drives_has_no_load_unless_the_file_names_one() -> None:
    axis = system("withheld/belt_axis.yaml")
    rail = axis.port("rail")
    assert load(axis, rail) is None
    tried = {place.name for e in effects() if e.family == "load_friction" for place in e.places(axis)}
    assert tried == {"motor"}
    assert load(axis, replace(rail, load="x_c")) == ("x_c", sp.Symbol("x_c", real=True))


def test_a_load_that_no_file_can_write_is_none(tmp_path: Path) -> None:
    (tmp_path / "map.csv").write_text("x,y\n0,0\n1,1\n2,4\n3,9\n")
    text = (SYSTEMS / "withheld" / "hoist.yaml").read_text()
    assert "kf*u" in text
    path = tmp_path / "hoist.yaml"
    path.write_text(
        text.replace("kf*u", "kf*u*diff(map(x/1.0), x)*1.0") + "tables:\n  map: {file: map.csv, x: x, y: y}\n"
    )
    known = read_system(path)
    assert load(known, known.port("rail")) is None


def test_a_long_load_is_written_with_the_signals_of_the_file(tmp_path: Path) -> None:
    """Each gear doubles the length of the load once the gears before it are inserted."""
    gears = "".join(f"  g{k}: g{k - 1}*(1.0 + 0.1*sin(g{k - 1}/one))\n" for k in range(1, 8))
    path = tmp_path / "train.yaml"
    path.write_text(
        "schema: system/1\nname: train\nstates: {x: {unit: m}, v: {unit: m/s}}\n"
        "inputs: {u: {unit: V}, w: {unit: N}}\noutputs: {x: {unit: m}}\n"
        "parameters: {M: {value: 2.0, unit: kg}, kf: {value: 3.0, unit: N/V}, one: {value: 1.0, unit: N},"
        " b: {value: 1.0, unit: N s/m}}\n"
        f"signals:\n  g0: kf*u\n{gears}  push: w*atan(g7/one)\n"
        "ports: {rail: {effort: F, unit: N, position: x, velocity: v}}\n"
        "dynamics: {x: v, v: (g7 + push - b*v - F)/M}\n"
    )
    train = read_system(path)
    found = load(train, train.port("rail"))
    assert found is not None and found[0] == "(g7 + push)"
    assert parse(found[0], scope_of(train), "") == found[1]
    for effect in effects():
        if effect.family == "load_friction":
            (place,) = effect.places(train)
            grown = effect.add(train, place, measured(train)).system
            write_system(grown, tmp_path / "augmented.yaml")
            assert read_system(tmp_path / "augmented.yaml") == grown
