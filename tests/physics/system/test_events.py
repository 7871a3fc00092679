"""Events in system files: what they say, what is refused, and that they are written back."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

from pipeline.chapters.equations import equations
from tests.machines.folders import system_of
from tests.machines.known import built_in, refusals, values_of, written_again
from unmodelled.systems.model import Event, System, symbol

COUPLING = """\
schema: system/1
name: coupling
states: {w1: {unit: rad/s, initial: 10}, w2: {unit: rad/s}, h: {unit: K}}
inputs: {T: {unit: N m}}
outputs:
  w1: {unit: rad/s}
operating_point: {J: {unit: kg m^2}}
parameters: {R: {value: 2, unit: '1'}, k: {value: 0.5, unit: N m s/rad}, c: {value: 0.1, unit: K/J}}
signals: {slip: w1 - R*w2, T_c: k*slip, T_f: T - F}
ports: {load: {effort: F, unit: N m, velocity: w2}}
dynamics: {w1: (T - T_c)/J, w2: (R*T_c - F)/J, h: c*T_c*slip}
events:
  lock: {expression: slip, then: {w2: T_f/J/3, h: 0}}
  hot: {expression: 400 - h - t}
"""

w1, w2, h, T, F, J, R, k, c, t = sp.symbols("w1 w2 h T F J R k c t", real=True)


@pytest.fixture
def coupling(tmp_path: Path) -> System:
    return system_of(COUPLING, tmp_path)


def test_an_event_has_an_expression_and_the_dynamics_after_it(coupling: System) -> None:
    system = coupling
    lock, hot = system.events
    assert (lock.name, hot.name) == ("lock", "hot")
    assert lock.expression == w1 - R * w2
    assert lock.then == (system.dynamics[0], (T - F) / J / 3, sp.S.Zero)
    assert hot == Event("hot", 400 - h - t, None)
    assert {place: text for place, text in system.text.items() if place.startswith("events")} == {
        "events.lock.expression": "slip",
        "events.lock.then.w2": "T_f/J/3",
        "events.lock.then.h": "0",
        "events.hot.expression": "400 - h - t",
    }


def test_without_events_there_are_none(tmp_path: Path) -> None:
    text = COUPLING[: COUPLING.index("events:")]
    assert system_of(text, tmp_path).events == ()
    assert system_of(f"{text}events:\n", tmp_path).events == ()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("expression: slip", "expression: slip - F", "events.lock.expression: the effort 'F' is not allowed"),
        ("expression: slip", "expression: slip + T_f", "'T_f' depends on the effort 'F'"),
        ("expression: slip", "expression: slip - lock", "expression: unknown symbol 'lock'"),
        ("expression: slip", "expression: w1 - h", "units differ: 'w1' is in 1/s, 'h' in K"),
        ("expression: slip", "expression: J*R - k", "units differ"),
        ("expression: slip", "expression: J*R", "depends on no state, no input and not on t"),
        ("expression: slip", "expression: 1", "depends on no state, no input and not on t"),
        ("expression: slip", "expression: [slip]", "events.lock.expression: must be a text"),
        ("expression: slip", "expression: open(w1)", "unknown function 'open'"),
        ("expression: slip, ", "", "events.lock: the key 'expression' is missing"),
        ("expression: slip", "expresion: slip", "unknown key 'expresion'; did you mean 'expression'?"),
        ("{w2: T_f/J/3, h: 0}", "{}", "events.lock.then: at least one state is needed"),
        ("{w2: T_f/J/3, h: 0}", "T_f/J", "events.lock.then: must be a mapping"),
        ("{w2: T_f/J/3", "{w3: T_f/J/3", "events.lock.then.w3: 'w3' is not a state"),
        ("{w2: T_f/J/3", "{w2: w1/R", "events.lock.then.w2: unit must be 1/s^2, got 1/s"),
        ("{w2: T_f/J/3", "{w2: T_q/J", "unknown symbol 'T_q'; did you mean 'T_f'?"),
        ("  lock: {", "  slip: {", "events.slip: the name 'slip' is taken by the signal of line 9"),
        ("  lock: {", "  w1: {", "events.w1: the name 'w1' is taken by the state of line 3"),
        ("  lock: {", "  F: {", "the name 'F' is taken by the effort"),
        ("  lock: {", "  clip: {", "the name 'clip' is reserved"),
        ("  lock: {", "  1st: {", "a name is a letter"),
        ("  w1: {unit: rad/s}", "  hot: {unit: K, expression: h}", "'hot' is taken by the event of line 14"),
        ("events:", "event:", "unknown key 'event'; did you mean 'events'?"),
        ("  hot: {expression: 400 - h - t}", "  - hot", "not a YAML file"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said_in_one_line(tmp_path: Path, old: str, new: str, words: str) -> None:
    head, tail = COUPLING.rsplit(old, 1)
    message, *_ = refusals(lambda: system_of(head + new + tail, tmp_path))
    assert words in message
    assert re.match(re.escape(str(tmp_path / "system.yaml")) + r": line \d+: ", message)
    assert "\n" not in message


def test_what_is_written_is_read_back(coupling: System, tmp_path: Path) -> None:
    assert written_again(coupling, tmp_path) == coupling


def test_without_text_only_the_dynamics_that_change_are_printed(coupling: System, tmp_path: Path) -> None:
    back = written_again(replace(coupling, text={}), tmp_path)
    assert back.events == coupling.events
    assert [place for place in back.text if "then" in place] == ["events.lock.then.w2", "events.lock.then.h"]


def test_dynamics_that_do_not_change_are_still_there(coupling: System, tmp_path: Path) -> None:
    same = replace(coupling, events=(Event("lock", symbol("w1"), coupling.dynamics),), text={})
    assert written_again(same, tmp_path).events == same.events


def test_events_are_shown_as_equations(coupling: System) -> None:
    found = equations(coupling)
    assert [(e.kind, e.text) for e in found if e.kind in ("event", "then")] == [
        ("event", "slip"),
        ("then", "T_f/J/3"),
        ("then", "0"),
        ("event", "400 - h - t"),
    ]


@pytest.mark.parametrize("name", ["clutch", "clutch_sharp"])
def test_the_clutch_is_that_of_appendix_3_8(name: str) -> None:
    system = built_in(name)
    assert system.uncertain == ("p_hc0", "z_p")
    p, w, s, omega_1, omega_2 = system.x
    u = system.u[0]
    value = {symbol(q.name): sp.Rational(repr(q.value)) for q in system.parameters}
    names = ("wn", "zeta", "Kp", "p_rest", "Kz", "tau_z", "c2", "p_hc0")
    wn, zeta, Kp, p_rest, Kz, tau_z, c2, p_hc0 = map(symbol, names)
    dp, dw, ds = system.dynamics[:3]
    rates = {str(x): f for x, f in zip(system.x, system.dynamics, strict=True)}
    for state in "pws":  # pressure and piston depend on the current alone
        assert not rates[state].free_symbols & {omega_1, omega_2, *system.c, *system.e}
    # eq. 3.16: p'' without the part b2*u', which dp holds as b2*u
    second = -2 * zeta * wn * dp - wn**2 * p + Kp * wn**2 * u + p_rest * wn**2
    assert sp.simplify(dw - second) == 0
    # eq. 3.17 for z~ = s - Kz*(p_hc0 - p_rest), whose rate is that of s
    piston = s - Kz * (p_hc0 - p_rest)
    assert sp.simplify(ds - (Kz / tau_z * (p - p_hc0) + c2 * dp - piston / tau_z)) == 0
    # at rest without current nothing moves
    rest = {**value, p: value[p_rest], w: 0, s: 0, u: 0}
    assert [f.subs(rest) for f in (dp, dw, ds)] == [0, 0, 0]
    assert [float(state.initial) for state in system.states[:3]] == [float(value[p_rest]), 0.0, 0.0]


@pytest.mark.parametrize("name", ["clutch", "clutch_sharp"])
def test_after_the_shift_the_shafts_turn_as_one(name: str) -> None:
    """Eq. 3.20: kinetic energy of both inertias changes by what the converter brings and the brake takes."""
    system = built_in(name)
    (shift,) = system.events
    assert shift.then is not None and shift.then[:3] == system.dynamics[:3]
    value = {q.name: q.value for q in system.parameters}
    w_2 = np.array([20.0, 40.0, 60.0])
    x = np.stack([np.full(3, 8e5), np.zeros(3), np.full(3, 1e-3), value["R"] * w_2, w_2], axis=-1)
    expressions = [*shift.then[3:], *(system.signals[n] for n in ("T_1", "T_b"))]
    d1, d2, T_1, T_b = values_of(system, expressions, x, [0.4], [157.0, 60.0], e=[3.0]).T
    np.testing.assert_allclose(d1, value["R"] * d2, rtol=1e-12)
    power = T_1 * x[:, 3] - (T_b + 3.0) * w_2
    np.testing.assert_allclose(value["J_1"] * x[:, 3] * d1 + value["J_2"] * w_2 * d2, power, rtol=1e-12)


def test_the_brake_holds_and_does_not_turn_the_load_back() -> None:
    system = built_in("clutch")
    for pressure, moves in ((2.1e5, False), (8e5, True)):
        x = [pressure, 0.0, 5.0e-3 if moves else 0.0, 157.0, 0.0]
        found = values_of(system, [system.dynamics[4]], x, [0.1], [157.0, 60.0])
        assert bool(found[0] > 0.0) is moves
        assert found[0] >= 0.0
