"""Terms of the known physics: inputs that drive a port, its load, and springs between bodies."""

from dataclasses import replace
from pathlib import Path

import pytest
import sympy as sp

from tests.machines.folders import changed, system_of
from tests.machines.known import SYSTEMS, built_in, written_again
from tests.physics.effects.benches import measured
from unmodelled.effects import known_terms
from unmodelled.effects.known_terms import driven_port, stiffness
from unmodelled.effects.library import effects
from unmodelled.effects.load import load
from unmodelled.systems.grammar import parse
from unmodelled.systems.model import System
from unmodelled.systems.scope import scope_of

COUPLING, HOIST = ((SYSTEMS / name).read_text() for name in ("coupling.yaml", "withheld/hoist.yaml"))
FOUR = "  d: {value: 0.1, unit: N m s/rad}\n  k_g: {value: 4, unit: N m/rad}\n"


def driven(system: System) -> list[tuple[str, int] | None]:
    found = (driven_port(system, item) for item in system.inputs)
    return [one and (one[0].name, one[1]) for one in found]


@pytest.mark.parametrize(
    ("file", "found"),
    [
        ("withheld/hoist", [("rail", 1)]),
        ("withheld/belt_axis", [("motor", 1)]),
        # the mass depends on the angle
        ("double_pendulum/friction_withheld", [("shoulder", 1), ("elbow", 1)]),
        # it acts at another body than the port
        ("slider_crank", [None]),
        ("cascaded_tanks/overflow_withheld", [None]),
        # a set point, and a switch that acts through its error
        ("xl330/friction_withheld", [None, None]),
        # a torque between the bodies is not that on the motor
        ("coupling", [None]),
    ],
)
def test_an_input_drives_the_port_whose_effort_acts_like_it(
    file: str, found: list[tuple[str, int] | None]
) -> None:
    assert driven(built_in(file)) == found


@pytest.mark.parametrize("file", ["arm", "withheld/hoist", "withheld/belt_axis"])
def test_where_input_and_effort_meet_is_enough(file: str, monkeypatch: pytest.MonkeyPatch) -> None:
    system = built_in(file)
    found = driven(system)
    monkeypatch.setattr(known_terms._Pair, "meeting", None)
    assert driven(system) == found and any(found)


@pytest.mark.parametrize(("drive", "sign"), [("-kf*u", -1), ("kf*clip(u, -0.5, 0.5)", 1)])
def test_an_input_drives_backwards_and_behind_a_law(drive: str, sign: int, tmp_path: Path) -> None:
    """Its speed has the opposite sign then; a law before the physics does not hide what it drives."""
    assert driven(system_of(changed(HOIST, ("kf*u", drive)), tmp_path)) == [("rail", sign)]


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
    text = changed(COUPLING, ("  d: {value: 0.1, unit: N m s/rad}\n", FOUR), (old, new))
    system = system_of(text, tmp_path)
    assert stiffness(system, system.port("shaft")) == sp.Symbol("k", real=True)


def test_the_stiffness_is_found_among_nested_fractions() -> None:
    """To cancel the quotients of ten symbols takes minutes; the stiffness depends on one of them."""
    names = "k J1 J2 m w dJ s1 s2 q1 q2 T"
    k, J1, J2, m, w, dJ, s1, s2, q1, q2, T = every = sp.symbols(names, real=True)
    one, two = J1 + s1, J2 + s2
    force = k * (q1 - q2) + T

    def held(effort: sp.Expr) -> sp.Expr:
        """Acceleration of the first body, on which a mass hangs by a spring."""
        return (effort + m * (effort / one + w**2 * q1) / (1 - m / one)) / one

    share = 1 + dJ * (1 / two + (1 + m / (one * (1 - m / one))) / one)
    rest = force - dJ * (force / two + held(force)) / share
    assert known_terms._stiffness((-held(rest), rest / two), q1 - q2, T, every[:8], ()) == k
    assert known_terms._stiffness((-held(rest), 2 * rest / two), q1 - q2, T, every[:8], ()) == k
    other = (rest + k * q2) / two
    assert known_terms._stiffness((-held(rest), other), q1 - q2, T, every[:8], ()) is None


@pytest.mark.parametrize(
    "changes",
    [
        # no spring, one that hardens, one that acts on one body only
        [("k*twist - d", "-d"), ("k*twist + d", "d")],
        [("k*twist", "k*(1 + (twist/1.0)**2)*twist")],
        [("(k*twist + d*slip + T)", "(d*slip + T)")],
    ],
)
def test_no_play_without_a_linear_spring(changes: list[tuple[str, str]], tmp_path: Path) -> None:
    system = system_of(changed(COUPLING, *changes), tmp_path)
    assert stiffness(system, system.port("shaft")) is None
    assert not [e for e in effects() if e.variant == "in_spring" and e.places(system)]


@pytest.mark.parametrize("file", ["so101/friction_withheld", "silverbox/hardening_withheld"])
def test_what_holds_a_single_body_is_no_spring_between_bodies(file: str) -> None:
    system = built_in(file)
    assert [stiffness(system, port) for port in system.ports] == [None]


@pytest.mark.parametrize(
    ("file", "port", "text"),
    [
        ("withheld/hoist", "rail", "kf*u"),
        ("withheld/belt_axis", "motor", "i*kf"),
        ("withheld/pendulum", "joint", "torque"),
        ("xl330/load_withheld", "horn", "tau_m"),
        ("so101/friction_withheld", "joint", "clip(k_p*(goal - q), -tau_max, tau_max)"),
    ],
)
def test_the_load_is_the_effort_of_the_inputs(file: str, port: str, text: str) -> None:
    known = built_in(file)
    found = load(known, known.port(port))
    assert found is not None and found[0] == text
    assert found[1].free_symbols & {*known.u}


def test_terms_without_inputs_are_no_load_and_signs_do_not_matter() -> None:
    hoist = built_in("withheld/hoist")
    turned = replace(hoist, dynamics=tuple(-f for f in hoist.dynamics))
    for known in (hoist, turned):
        found = load(known, known.port("rail"))
        assert found is not None and found[1] == sp.Mul(*sp.symbols("kf u", real=True))


def test_a_port_that_no_input_drives_has_no_load_unless_the_file_names_one() -> None:
    axis = built_in("withheld/belt_axis")
    rail = axis.port("rail")
    assert load(axis, rail) is None
    tried = {place.name for e in effects() if e.family == "load_friction" for place in e.places(axis)}
    assert tried == {"motor"}
    assert load(axis, replace(rail, load="x_c")) == ("x_c", sp.Symbol("x_c", real=True))


def test_a_load_that_no_file_can_write_is_none(tmp_path: Path) -> None:
    (tmp_path / "map.csv").write_text("x,y\n0,0\n1,1\n2,4\n3,9\n")
    text = changed(HOIST, ("kf*u", "kf*u*diff(map(x/1.0), x)*1.0"))
    known = system_of(f"{text}tables:\n  map: {{file: map.csv, x: x, y: y}}\n", tmp_path)
    assert load(known, known.port("rail")) is None


def test_a_long_load_is_written_with_the_signals_of_the_file(tmp_path: Path) -> None:
    """Each gear doubles the length of the load once the gears before it are inserted."""
    gears = "".join(f"  g{k}: g{k - 1}*(1.0 + 0.1*sin(g{k - 1}/one))\n" for k in range(1, 8))
    train = system_of(
        "schema: system/1\nname: train\nstates: {x: {unit: m}, v: {unit: m/s}}\n"
        "inputs: {u: {unit: V}, w: {unit: N}}\noutputs: {x: {unit: m}}\n"
        "parameters: {M: {value: 2.0, unit: kg}, kf: {value: 3.0, unit: N/V}, one: {value: 1.0, unit: N},"
        " b: {value: 1.0, unit: N s/m}}\n"
        f"signals:\n  g0: kf*u\n{gears}  push: w*atan(g7/one)\n"
        "ports: {rail: {effort: F, unit: N, position: x, velocity: v}}\n"
        "dynamics: {x: v, v: (g7 + push - b*v - F)/M}\n",
        tmp_path,
    )
    found = load(train, train.port("rail"))
    assert found is not None and found[0] == "(g7 + push)"
    assert parse(found[0], scope_of(train), "") == found[1]
    for effect in effects():
        if effect.family == "load_friction":
            (place,) = effect.places(train)
            grown = effect.add(train, place, measured(train)).system
            assert written_again(grown, tmp_path) == grown
