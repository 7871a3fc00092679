"""Terms of the known physics that act like the effort of a port: inputs that drive it, and springs."""

from __future__ import annotations

from pathlib import Path

import pytest
import sympy as sp

from unmodelled.effects import known_terms
from unmodelled.effects.known_terms import driven_port, stiffness
from unmodelled.effects.library import effects
from unmodelled.systems.model import System
from unmodelled.systems.reader import read_system

SYSTEMS = Path(__file__).parents[3] / "systems"
COUPLING = (SYSTEMS / "coupling.yaml").read_text()
FOUR = "  d: {value: 0.1, unit: N m s/rad}\n  k_g: {value: 4, unit: N m/rad}\n"


def driven(system: System) -> list[tuple[str, int] | None]:
    found = (driven_port(system, item) for item in system.inputs)
    return [one and (one[0].name, one[1]) for one in found]


def changed(folder: Path, *changes: tuple[str, str], text: str = COUPLING) -> System:
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / "system.yaml").write_text(text)
    return read_system(folder / "system.yaml")


@pytest.mark.parametrize(
    ("file", "found"),
    [
        ("withheld/hoist.yaml", [("rail", 1)]),
        ("withheld/belt_axis.yaml", [("motor", 1)]),
        # the mass depends on the angle
        ("double_pendulum/friction_withheld.yaml", [("shoulder", 1), ("elbow", 1)]),
        # it acts at another body than the port
        ("slider_crank.yaml", [None]),
        ("cascaded_tanks/overflow_withheld.yaml", [None]),
        # a set point, and a switch that acts through its error
        ("xl330/friction_withheld.yaml", [None, None]),
        # a torque between the bodies is not that on the motor
        ("coupling.yaml", [None]),
    ],
)
def test_an_input_drives_the_port_whose_effort_acts_like_it(
    file: str, found: list[tuple[str, int] | None]
) -> None:
    assert driven(read_system(SYSTEMS / file)) == found


@pytest.mark.parametrize("file", ["arm.yaml", "withheld/hoist.yaml", "withheld/belt_axis.yaml"])
def test_where_input_and_effort_meet_tells_what_all_rates_tell(
    file: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    system = read_system(SYSTEMS / file)
    found = driven(system)
    monkeypatch.setattr(known_terms._Pair, "meeting", None)
    assert driven(system) == found and any(found)


def test_the_speed_of_an_input_that_drives_backwards_has_the_opposite_sign(tmp_path: Path) -> None:
    text = (SYSTEMS / "withheld" / "hoist.yaml").read_text()
    backwards = changed(tmp_path, ("kf*u", "-kf*u"), text=text)
    assert driven(backwards) == [("rail", -1)]


def test_a_law_before_the_physics_does_not_hide_what_an_input_drives(tmp_path: Path) -> None:
    text = (SYSTEMS / "withheld" / "hoist.yaml").read_text()
    limited = changed(tmp_path, ("kf*u", "kf*clip(u, -0.5, 0.5)"), text=text)
    assert driven(limited) == [("rail", 1)]


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("", ""),
        # other springs and weights on one of the bodies
        ("(u - k*twist", "(u - k_g*q1 - k*twist"),
        ("(k*twist + d*slip + T)", "(k*twist + d*slip + T - k_g*sin(q2))"),
        ("- T)/J1", "- T)/(J1 + J2)"),
    ],
)
def test_the_stiffness_is_that_of_the_spring_between_the_bodies(old: str, new: str, tmp_path: Path) -> None:
    system = changed(tmp_path, ("  d: {value: 0.1, unit: N m s/rad}\n", FOUR), (old, new))
    assert stiffness(system, system.port("shaft")) == sp.Symbol("k", real=True)


@pytest.mark.parametrize(
    "changes",
    [
        # no spring, one that hardens, one that acts on one body only
        [("k*twist - d", "-d"), ("k*twist + d", "d")],
        [("k*twist", "k*(1 + (twist/1.0)**2)*twist")],
        [("(k*twist + d*slip + T)", "(d*slip + T)")],
    ],
)
def test_there_is_no_play_without_a_linear_spring_between_the_bodies(
    changes: list[tuple[str, str]], tmp_path: Path
) -> None:
    system = changed(tmp_path, *changes)
    assert stiffness(system, system.port("shaft")) is None
    assert not [e for e in effects() if e.variant == "in_spring" and e.places(system)]


@pytest.mark.parametrize("file", ["so101/friction_withheld.yaml", "silverbox/hardening_withheld.yaml"])
def test_what_holds_a_single_body_is_no_spring_between_bodies(file: str) -> None:
    system = read_system(SYSTEMS / file)
    assert [stiffness(system, port) for port in system.ports] == [None]
