"""Ports of mechanics and of balances: which is which, and what is said of efforts that make no power."""

from __future__ import annotations

from pathlib import Path

import pytest

from unmodelled.base.errors import BadInput
from unmodelled.effects.library import effects
from unmodelled.systems.model import System
from unmodelled.systems.reader import read_system

TEXT = """
schema: system/1
name: vessel
states:
  h: {{unit: {level}}}
  w: {{unit: {level}/s}}
inputs:
  u: {{unit: 1/s}}
outputs:
  h: {{unit: {level}}}
parameters:
  k: {{value: 0.5, unit: 1/s^2}}
  c: {{value: 1.0, unit: {gain}}}
ports:
  place: {{effort: q, unit: {effort}, {rest}}}
dynamics:
  h: w
  w: -k*h - q/c
"""


def vessel(folder: Path, effort: str, gain: str, rest: str, level: str = "m") -> System:
    path = folder / "vessel.yaml"
    path.write_text(TEXT.format(level=level, effort=effort, gain=gain, rest=rest))
    return read_system(path)


@pytest.mark.parametrize(
    ("effort", "gain", "rest", "domain"),
    [
        ("N", "kg", "position: h", "power"),
        ("N", "kg", "position: h, velocity: w", "power"),
        ("N", "kg", "position: h, kind: balance", "balance"),
        ("m^3/s", "m^2 s", "position: h", "balance"),
        ("m^3/s", "m^2 s", "position: h, kind: power", "power"),
        ("m^3/s", "m^2 s", "position: h, velocity: w", "power"),
    ],
)
def test_a_port_is_a_balance_unless_it_is_mechanical(
    effort: str, gain: str, rest: str, domain: str, tmp_path: Path
) -> None:
    system = vessel(tmp_path, effort, gain, rest)
    assert system.port("place").domain == domain
    families = {e.family for e in effects() if any(p.kind == "port" for p in e.places(system))}
    assert ("overflow" in families) == (domain == "balance")
    assert ("linear_spring" in families) == (domain == "power")
    assert "constant_load" in families


def test_an_effort_that_makes_no_power_is_a_note_and_a_force_that_makes_none_is_refused(
    tmp_path: Path,
) -> None:
    volts = vessel(tmp_path, "V", "s^2", "position: h, velocity: w", level="V")
    (note,) = volts.notes
    assert "ports.place" in note and "V^2/s" in note
    assert vessel(tmp_path, "N", "kg", "position: h, velocity: w").notes == ()
    with pytest.raises(BadInput, match="must be a power, in W"):
        vessel(tmp_path, "N", "kg", "velocity: h")


def test_laws_of_heat_are_tried_where_the_level_is_a_temperature(tmp_path: Path) -> None:
    tried = {}
    for level, effort, gain in (("K", "W", "J s/K"), ("m", "m^3/s", "m^2 s")):
        system = vessel(tmp_path, effort, gain, "position: h", level=level)
        tried[level] = {e.family for e in effects() if any(p.kind == "port" for p in e.places(system))}
    assert tried["K"] - tried["m"] == {"radiation"}
    assert tried["m"] - tried["K"] == {"overflow", "root_outflow"}
