"""Ports get the laws of their domain by the units of effort and coordinate, not by the word in the file."""

from pathlib import Path

import pytest

from tests.machines.folders import system_of, text_of
from unmodelled.effects.library import effects, without_own_laws
from unmodelled.systems.model import System
from unmodelled.systems.reader import read_system
from unmodelled.systems.units import SECOND, describe, parse_unit, power, times


def machine(folder: Path, effort: str, level: str, port: str) -> System:
    """A system of one state `s`, which the port names, or the signal `shown` of it."""
    sizes = times(parse_unit(effort).dimension, SECOND), power(parse_unit(level).dimension, -1)  # type: ignore[arg-type]
    (folder / "machine.yaml").write_text(f"""schema: system/1
name: machine
states: {{s: {{unit: {level}}}}}
inputs: {{u: {{unit: {effort}}}}}
outputs: {{s: {{unit: {level}}}}}
parameters: {{size: {{value: 2.0, unit: "{describe(times(*sizes))}"}}}}
signals: {{shown: s}}
ports: {{place: {{effort: e, unit: {effort}, {port}}}}}
dynamics: {{s: (u - e)/size}}
""")
    return read_system(folder / "machine.yaml")


def laws(system: System) -> set[str]:
    return {effect.family for effect in effects() for place in effect.places(system) if place.kind == "port"}


@pytest.mark.parametrize(
    ("effort", "level", "word", "usual"),
    [
        ("V", "A", "position", "velocity"),  # solenoid
        ("Pa", "m^3/s", "position", "velocity"),  # water hammer in a pipe
        ("N m", "rad/s", "position", "velocity"),  # flywheel
        ("A", "V", "velocity", "position"),  # capacitor
        ("m^3/s", "Pa", "velocity", "position"),  # accumulator
        ("W", "K", "velocity", "position"),  # oven
    ],
)
@pytest.mark.parametrize("name", ["s", "shown"])
def test_units_go_before_the_word_of_the_file(
    tmp_path: Path, effort: str, level: str, word: str, usual: str, name: str
) -> None:
    right = machine(tmp_path, effort, level, f"{usual}: {name}")
    wrong = machine(tmp_path, effort, level, f"{word}: {name}")
    assert wrong == right and laws(wrong) == laws(right)
    (note,) = wrong.notes
    assert note.startswith("ports.place: e is") and note.endswith(f"read as {usual}: {name}")
    assert not right.notes and not without_own_laws(wrong)


def test_a_coil_is_one_by_its_units(tmp_path: Path) -> None:
    found = laws(machine(tmp_path, "V", "A", "position: shown"))
    assert {"inductance_saturation", "self_heating", "viscous_friction"} <= found
    assert "linear_loss" not in found


def test_a_temperature_that_a_signal_shows_radiates(tmp_path: Path) -> None:
    assert "radiation" in laws(machine(tmp_path, "W", "K", "position: shown"))


def test_a_given_kind_goes_before_units(tmp_path: Path) -> None:
    system = machine(tmp_path, "V", "A", "position: s, kind: balance")
    assert system.port("place").position == "s" and "linear_loss" in laws(system)


@pytest.mark.parametrize(("effort", "level", "key"), [("W", "K", "position"), ("N", "m/s", "velocity")])
def test_a_place_without_laws_of_its_domain_says_so(
    tmp_path: Path, effort: str, level: str, key: str
) -> None:
    kind = "balance" if key == "position" else "power"
    (note,) = without_own_laws(machine(tmp_path, effort, level, f"kind: {kind}"))
    assert f"no law of its domain ({kind})" in note and f"name a {key}" in note


def test_a_system_without_ports_is_told(tmp_path: Path) -> None:
    (note,) = without_own_laws(system_of(text_of("servo.yaml"), tmp_path))
    assert note.startswith("the system file has no port: errors of drives, sensors and parameters were tried")
