"""Reading system files: what is accepted, and that any other file is refused in one line and in time."""

from __future__ import annotations

import time
from pathlib import Path

import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.physics.system.hoist import HOIST, changed, complaint, written
from unmodelled.base.errors import BadInput
from unmodelled.systems.model import Constant, symbol
from unmodelled.systems.reader import read_system

SYSTEMS = Path(__file__).parents[3] / "systems"


def test_the_example_of_the_contract(tmp_path: Path) -> None:
    system = read_system(written(tmp_path, HOIST))
    x, v, u, M, kf, b, F = map(symbol, ("x", "v", "u", "M", "kf", "b", "F_rail"))
    assert system.name == "hoist"
    assert (system.x, system.u, system.e) == ((x, v), (u,), (F,))
    assert system.signals == {"F_m": kf * u}
    assert system.dynamics[0] == v
    assert sp.simplify(system.dynamics[1] - ((kf * u - b * v - F) / M - 9.81)) == 0
    assert [o.expression for o in system.outputs] == [x, v]
    assert system.uncertain == ("b",)
    assert system.parameters[2].bounds == (5.0, 90.0)
    assert system.tables[0].x == (0.0, 0.5, 0.9, 1.0)
    assert system.text == {
        "signals.F_m": "kf*u",
        "dynamics.x": "v",
        "dynamics.v": "(F_m - b*v - F_rail)/M - 9.81",
    }


@pytest.mark.parametrize("name", ["pendulum", "slider_crank"])
def test_the_systems_that_come_along(name: str) -> None:
    begin = time.perf_counter()
    system = read_system(SYSTEMS / f"{name}.yaml")
    assert time.perf_counter() - begin < 20.0
    assert system.name == name
    assert len(system.dynamics) == len(system.states) == 2
    assert {str(s) for f in system.dynamics for s in f.free_symbols} <= {
        str(s) for s in (*system.x, *system.u, *system.p, *system.e)
    }


def test_slider_crank_is_the_one_of_chapter_4() -> None:
    """At theta = pi/2 the rod's angle has sin = l1/l2; k = -l1 there (eq. 4.1 differentiated)."""
    system = read_system(SYSTEMS / "slider_crank.yaml")
    at = {symbol("theta"): sp.pi / 2, **dict(zip(system.p, system.values, strict=True))}
    assert float(system.signals["k"].subs(at)) == pytest.approx(-0.05)
    assert float(system.signals["k_phi"].subs(at)) == pytest.approx(0.0)


def test_constants_that_the_file_gives_and_an_input_that_is_logged_late(tmp_path: Path) -> None:
    text = changed("  m: {unit: kg}", "  m: {unit: kg, values: {7: 0.5, a b: -1e-3}, other: 2}").replace(
        "column: u}", "column: u, delay: -0.0005}"
    )
    system = read_system(written(tmp_path, text))
    assert system.operating_point == (Constant("m", "kg", {"7": 0.5, "a b": -0.001}, 2.0),)
    assert system.inputs[0].delay == -0.0005


def test_a_constant_of_which_a_new_experiment_has_a_number_of_its_own(tmp_path: Path) -> None:
    entries = "{unit: kg, values: {a: 0.5}, other: 0.6, identify: true, bounds: [0.1, 0.9]}"
    system = read_system(written(tmp_path, changed("  m: {unit: kg}", f"  m: {entries}")))
    assert system.operating_point == (Constant("m", "kg", {"a": 0.5}, 0.6, identify=True, bounds=(0.1, 0.9)),)


def test_there_may_be_a_value_for_every_experiment_of_a_large_campaign(tmp_path: Path) -> None:
    values = ", ".join(f"run{i}: {i}" for i in range(3000))
    text = changed("  m: {unit: kg}", f"  m: {{unit: kg, values: {{{values}}}}}")
    (constant,) = read_system(written(tmp_path, text)).operating_point
    assert constant.values is not None and constant.values["run2999"] == 2999.0


@pytest.mark.parametrize(
    ("raw", "words"),
    [
        (b"", "the file is empty"),
        (b"# nothing\n", "the file is empty"),
        (b"- a\n- b\n", "a system file is a mapping"),
        (b"hello", "a system file is a mapping"),
        (b"schema: system/1\nname: \xff\n", "line 2: not UTF-8"),
        (b"schema: system/1\nname: a\x00b\n", "line 2: a control character"),
        (b"schema: system/1\n---\nname: a\n", "line 2: only one document"),
        (b"[" * 100_000, ""),
        (b"a: " * 100_000, ""),
        (b"x" * 1_000_001, "at most 1000000 bytes"),
        (b"a: &a [x]\nb: [*a, *a]\n", "line 1: a: anchors"),
        (b"schema: system/1\n" + b"".join(b"k%d: 1\n" % i for i in range(1001)), "too many entries"),
    ],
)
def test_files_that_are_no_system(tmp_path: Path, raw: bytes, words: str) -> None:
    path = tmp_path / "system.yaml"
    path.write_bytes(raw)
    assert words in complaint(path)


def test_missing_file_and_folder(tmp_path: Path) -> None:
    assert "no such file" in complaint(tmp_path / "none.yaml")
    assert "no such file" in complaint(tmp_path)


def test_autonomous_and_minimal(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text(
        "schema: system/1\nname: decay\nstates:\n  y: {unit: K, initial: -1e-3}\ninputs:\n"
        "outputs:\n  n: {unit: K, expression: 2*y, delay: 0.01}\n  y: {unit: K}\ndynamics: {y: 0}\n"
    )
    system = read_system(path)
    assert system.inputs == ()
    assert system.states[0].initial == -1e-3
    assert (system.outputs[0].column, system.outputs[0].delay) == ("n", 0.01)
    assert system.outputs[0].expression == 2 * symbol("y")
    assert system.dynamics == (sp.S.Zero,)


@pytest.mark.parametrize(
    "rule", ["(s{0} + 1)*(s{0} + 2)", "sin(s{0})", "sin(s{0})*diff(s{0}, x)", "abs(s{0})**sin(s{0})"]
)
def test_signals_cannot_grow_without_bound(tmp_path: Path, rule: str) -> None:
    grown = "".join(f"  s{i + 1}: {rule.format(i)}\n" for i in range(900))
    text = changed("  F_m: kf*u\n", f"  F_m: kf*u\n  s0: x/0.7\n{grown}")
    begin = time.perf_counter()
    assert "too large" in complaint(written(tmp_path, text))
    assert time.perf_counter() - begin < 20.0


@given(raw=st.binary(max_size=300))
@settings(max_examples=100, deadline=2000)
def test_random_bytes_are_refused_in_one_line(tmp_path_factory: pytest.TempPathFactory, raw: bytes) -> None:
    path = tmp_path_factory.getbasetemp() / "random.yaml"
    path.write_bytes(raw)
    complaint(path)


@given(
    cut=st.integers(0, len(HOIST)),
    length=st.integers(0, 40),
    put=st.text(st.sampled_from(" \n:{}[],#&*!|>-'\"%@`?~0.1eEaxvuFM_()+/\t\\\x85é"), max_size=12),
)
@settings(max_examples=150, deadline=2000)
def test_random_edits_are_read_or_refused(
    tmp_path_factory: pytest.TempPathFactory, cut: int, length: int, put: str
) -> None:
    path = written(tmp_path_factory.getbasetemp(), HOIST[:cut] + put + HOIST[cut + length :])
    try:
        read_system(path)
    except BadInput as error:
        assert len(str(error).splitlines()) == 1
