"""Reading system files: what is accepted, and the one line that says what is wrong and where."""

from __future__ import annotations

import re
import time
from pathlib import Path

import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.errors import BadInput
from pipeline.physics.system.model import Constant, symbol
from pipeline.physics.system.reader import read_system

SYSTEMS = Path(__file__).parents[3] / "systems"

HOIST = """\
schema: system/1
name: hoist
states:                        # order = state vector x
  x: {unit: m}
  v: {unit: m/s}               # optional keys: initial (default 0; used when no output measures it)
inputs:                        # order = input vector u
  u: {unit: V, column: u}      # log column; optional: delay [s] (default 0)
outputs:                       # y = g(x, u; p); a log column each
  x: {column: x, unit: m}      # optional: expression (default: the state of that name), delay [s]
  v: {column: v, unit: m/s}
operating_point:               # optional; constants of one experiment, columns of experiments.csv
  m: {unit: kg}
parameters:
  M:  {value: 8.5, unit: kg}                                           # known: held fixed
  kf: {value: 12.0, unit: N/V}
  b:  {value: 31.0, unit: N s/m, identify: true, bounds: [5, 90]}      # uncertain: identified
signals:                       # named expressions, in order; diff(expression, state) is allowed
  F_m: kf*u
ports:                         # where an effort that the model leaves out can act
  rail: {effort: F_rail, unit: N, position: x, velocity: v}   # position/velocity: state or signal
tables:                        # optional: measured characteristics
  f_t: {file: converter.csv, x: speed_ratio, y: torque_ratio, kind: cubic}
dynamics:                      # time derivative of every state; efforts appear as symbols
  x: v
  v: (F_m - b*v - F_rail)/M - 9.81
"""
CONVERTER = "speed_ratio,torque_ratio\n0,2.0\n0.5,1.5\n0.9,1.0\n1.0,0.2\n"


def written(folder: Path, text: str, table: str = CONVERTER) -> Path:
    (folder / "converter.csv").write_text(table)
    path = folder / "hoist.yaml"
    path.write_text(text)
    return path


def changed(old: str, new: str) -> str:
    assert HOIST.count(old) == 1, f"{old!r} must occur once"
    return HOIST.replace(old, new)


def line_of(text: str, part: str) -> int:
    return text[: text.index(part)].count("\n") + 1


def complaint(path: Path) -> str:
    with pytest.raises(BadInput) as caught:
        read_system(path)
    message = str(caught.value)
    assert "\n" not in message and message.isprintable()
    assert message.startswith(f"{path}: ")
    return message


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
    assert time.perf_counter() - begin < 2.0
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


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        # the document
        ("schema: system/1", "schema: system/2", "schema: must start with 'schema: system/1'"),
        ("schema: system/1\n", "", "must start with"),
        ("name: hoist\n", "", "the key 'name' is missing"),
        ("name: hoist", "name: 3 hoists", "name: a name is a letter"),
        ("name: hoist", "name:", "name: must be a text, got nothing"),
        ("name: hoist", "name: hoist\nname: crane", "the key 'name' is written twice, first in line 2"),
        ("  m: {unit: kg}", "  m: {unit: kg}\n  m: {unit: kg}", "the key 'm' is written twice"),
        ("name: hoist", "name: &a hoist", "anchors"),
        ("  v: {column: v, unit: m/s}", "  v: *a", "anchors"),
        (
            "name: hoist",
            "name: !!python/object/apply:os.system [echo]",
            "the tag 'tag:yaml.org,2002:python/object",
        ),
        ("name: hoist", "name: !!str hoist", "the tag"),
        ("  kf: {value", "\tkf: {value", "a tab; indent with spaces"),
        ("name: hoist", "name: [hoist", "not a YAML file"),
        ("name: hoist", "name: hoist\n? [a, b]\n: c", "a key must be a word"),
        ("name: hoist", "name: hoist\nstate: {}", "unknown key 'state'; did you mean 'states'?"),
        ("name: hoist", "name: hoist\nqqq: {}", "unknown key 'qqq', must be one of schema, name"),
        ("  x: v\n", "  x: [[[[[[[[v]]]]]]]]\n", "dynamics.x"),
        # names
        ("  M:  {value", "  1M: {value", "a name is a letter"),
        ("  M:  {value", "  F_m: {value", "signals.F_m: the name 'F_m' is taken by the parameter of line"),
        ("  M:  {value", "  x: {value", "parameters.x: the name 'x' is taken by the state of line 4"),
        ("  M:  {value", "  pi: {value", "the name 'pi' is reserved"),
        ("  M:  {value", "  t: {value", "the name 't' is reserved"),
        ("  M:  {value", "  clip: {value", "the name 'clip' is reserved"),
        ("  M:  {value", "  lambda: {value", "the name 'lambda' is reserved"),
        ("  M:  {value", "  été: {value", "a name is a letter"),
        ("  m: {unit: kg}", "  file: {unit: kg}", "is a column of its own in experiments.csv"),
        ("effort: F_rail", "effort: u", "the name 'u' is taken by the input"),
        # constants that the file gives
        ("  m: {unit: kg}", "  m: {unit: kg, values: [1]}", "values: must be a mapping"),
        ("  m: {unit: kg}", "  m: {unit: kg, values: {}}", "values: at least one is needed, or other"),
        ("  m: {unit: kg}", "  m: {unit: kg, values: {a: heavy}}", "values.a: must be a number, got 'heavy'"),
        ("  m: {unit: kg}", "  m: {unit: kg, values: {a: }}", "values.a: must be a number, got nothing"),
        ("  m: {unit: kg}", "  m: {unit: kg, values: {a: 1, a: 2}}", "the key 'a' is written twice"),
        ("  m: {unit: kg}", "  m: {unit: kg, other: 1}", "other: needs values beside it"),
        ("  m: {unit: kg}", "  m: {unit: kg, values: {a: 1}, other: a}", "other: must be a number"),
        ("  m: {unit: kg}", "  m: {unit: kg, value: {a: 1}}", "unknown key 'value'; did you mean 'values'?"),
        # numbers
        ("value: 8.5", "value: heavy", "parameters.M.value: must be a number, got 'heavy'"),
        ("value: 8.5", "value: .inf", "must be a number"),
        ("value: 8.5", "value: 1e999", "must be a finite number"),
        ("value: 8.5", "value: [8.5]", "must be a number, got a list of 1"),
        ("value: 8.5, ", "", "the key 'value' is missing"),
        ("bounds: [5, 90]", "bounds: [90, 5]", "bounds: must increase, got [90, 5]"),
        ("bounds: [5, 90]", "bounds: [40, 90]", "must contain the value 31"),
        ("bounds: [5, 90]", "bounds: [5]", "must be two numbers [low, high]"),
        ("bounds: [5, 90]", "bounds: 5", "must be two numbers [low, high], got '5'"),
        ("identify: true", "identify: yes please", "identify: must be true or false"),
        ("identify: true", "identfy: true", "unknown key 'identfy'; did you mean 'identify'?"),
        ("unit: V, column: u", "unit: V, column: u, delay: early", "inputs.u.delay: must be a number"),
        ("column: v, unit: m/s", "column: v, unit: m/s, delay: -0.1", "v.delay: must not be negative"),
        ("  v: {unit: m/s} ", "  v: {unit: m/s, initial: fast} ", "states.v.initial: must be a number"),
        ("column: u}", "column: t}", "other than the time t"),
        ("column: v, unit", "column: x, unit", "the column 'x' is already an output"),
        # units
        (
            "  x: {unit: m}",
            "  x: {unit: mm}",
            "states.x.unit: 'mm' must be in SI units, e.g. m instead of mm",
        ),
        ("unit: N s/m", "unit: furlongs^22", "is not a unit"),
        ("unit: N s/m", "unit: N q/m", "unknown unit 'q'"),
        ("unit: N s/m", "unit: __import__('os')", "parameters.b.unit: \"__import__('os')\" is not a unit"),
        ("  x: {unit: m}", "  x: {}", "the key 'unit' is missing"),
        ("  x: v\n", "  x: v/M\n", "dynamics.x: unit must be m/s, got m/(kg s)"),
        (
            "  v: (F_m - b*v - F_rail)/M - 9.81",
            "  v: F_m - b*v - F_rail - 9.81",
            "dynamics.v: unit must be m/s^2, got N",
        ),
        ("(F_m - b*v - F_rail)/M", "(F_m - b*x - F_rail)/M", "units differ: 'F_m' is in N, 'b*x' in kg m/s"),
        ("unit: N, position: x, velocity: v}", "unit: N, velocity: x}", "must be a power, in W, got N m"),
        ("column: v, unit: m/s}", "column: v, unit: m/s, expression: b*v}", "unit must be m/s, got N"),
        ("velocity: v}", "velocity: v, law: M*v}", "ports.rail.law: unit must be N, got"),
        # sections
        (
            "dynamics:                      #",
            "dynamic:  #",
            "unknown key 'dynamic'; did you mean 'dynamics'?",
        ),
        ("  x: v\n", "", "dynamics: the state 'x' has no dynamics"),
        ("  x: v\n", "  x: v\n  z: v\n", "'z' is not a state, must be one of v, x"),
        ("  x: v\n", "  x:\n", "dynamics.x: must be a text, got nothing"),
        ("  x: {column: x, unit: m} ", "  y: {column: x, unit: m} ", "outputs.y: needs an expression"),
        (
            "  x: {column: x, unit: m} ",
            "  M: {column: x, unit: m} ",
            "outputs.M: the name 'M' is taken by the parameter",
        ),
        # signals, efforts, ports
        (
            "  F_m: kf*u",
            "  F_m: 2*G\n  G: kf*u",
            "signals must be in order: 'F_m' uses 'G', which is defined later",
        ),
        ("  F_m: kf*u", "  F_m: F_m + u", "cycle in signals: F_m -> F_m"),
        ("  F_m: kf*u", "  F_m: G + 1\n  G: H\n  H: F_m", "cycle in signals: F_m -> G -> H -> F_m"),
        (" - F_rail)/M", ")/M", "effort 'F_rail' of port 'rail' appears in no dynamics"),
        ("position: x", "position: u", "ports.rail.position: must be a state or a signal, got 'u'"),
        ("velocity: v}", "velocity: w}", "ports.rail.velocity: must be a state or a signal, got 'w'"),
        ("velocity: v}", "velocity: v, law: b*v + F_rail}", "law: the effort 'F_rail' is not allowed here"),
        ("unit: m} ", "unit: m, expression: x + F_rail} ", "expression: the effort 'F_rail' is not allowed"),
        ("effort: F_rail, ", "", "ports.rail: the key 'effort' is missing"),
        # tables
        ("file: converter.csv", "file: ../converter.csv", "must lie in the folder"),
        ("file: converter.csv", "file: /etc/passwd", "must lie in the folder"),
        ("file: converter.csv", "file: nothing.csv", "'nothing.csv': no such file"),
        ("file: converter.csv", 'file: "a\\0b"', "no such file"),
        ("x: speed_ratio", "x: speed", "one column 'speed', got 'speed_ratio', 'torque_ratio'"),
        ("kind: cubic}", "kind: quintic}", "must be cubic or linear, got 'quintic'"),
        # expressions: the rest is in test_grammar
        ("  x: v\n", "  x: __import__('os').system('echo')\n", "dynamics.x: '__import__' is not allowed"),
        ("  x: v\n", "  x: v.real\n", "'.real' is not allowed"),
        ("  x: v\n", "  x: w + v\n", "unknown symbol 'w', must be one of"),
        ("  x: v\n", "  x: 9**9**9**9\n", "no finite real value"),
        ("  x: v\n", "  x: diff(v, M)\n", "the second argument must be a state, got 'M'"),
        ("  x: v\n", "  x: f_t(x, v)\n", "'f_t' takes 1 argument, got 2"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(tmp_path: Path, old: str, new: str, words: str) -> None:
    message = complaint(written(tmp_path, changed(old, new)))
    assert words in message
    assert re.search(r": line \d+: ", message), message


@pytest.mark.parametrize(
    ("old", "new", "part"),
    [
        ("value: 8.5", "value: heavy", "value: heavy"),
        ("  v: (F_m - b*v - F_rail)/M - 9.81", "  v: (F_m - b*v - F_rail)/M - z", "- z"),
        ("  F_m: kf*u", "  F_m: kf*u\n  G: F_m +", "  G:"),
        ("  kf: {value", "\tkf: {value", "\tkf"),
        ("  x: {column: x, unit: m}", "  x:\n    column: x\n    unit: cm", "    unit: cm"),
    ],
)
def test_the_line_is_the_right_one(tmp_path: Path, old: str, new: str, part: str) -> None:
    text = changed(old, new)
    path = written(tmp_path, text)
    assert complaint(path).startswith(f"{path}: line {line_of(text, part)}: ")


def test_constants_that_the_file_gives_and_an_input_that_is_logged_late(tmp_path: Path) -> None:
    text = changed("  m: {unit: kg}", "  m: {unit: kg, values: {7: 0.5, a b: -1e-3}, other: 2}").replace(
        "column: u}", "column: u, delay: -0.0005}"
    )
    system = read_system(written(tmp_path, text))
    assert system.operating_point == (Constant("m", "kg", {"7": 0.5, "a b": -0.001}, 2.0),)
    assert system.inputs[0].delay == -0.0005


def test_there_may_be_a_value_for_every_experiment_of_a_large_campaign(tmp_path: Path) -> None:
    values = ", ".join(f"run{i}: {i}" for i in range(3000))
    text = changed("  m: {unit: kg}", f"  m: {{unit: kg, values: {{{values}}}}}")
    (constant,) = read_system(written(tmp_path, text)).operating_point
    assert constant.values is not None and constant.values["run2999"] == 2999.0


def test_an_effort_hidden_in_a_signal_is_found(tmp_path: Path) -> None:
    text = changed("  F_m: kf*u", "  F_m: kf*u\n  F_all: F_m - F_rail").replace(
        "velocity: v}", "velocity: v, law: F_all}"
    )
    message = complaint(written(tmp_path, text))
    assert "'F_all' depends on the effort 'F_rail', which is not allowed here" in message


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ("", "the file is empty"),
        ("speed_ratio,torque_ratio\n0,1\n", "at least 2 rows, got 1"),
        (
            "speed_ratio,torque_ratio\n0,1\n1,abc\n",
            "row 3, column 'torque_ratio': must be a number, got 'abc'",
        ),
        ("speed_ratio,torque_ratio\n0,1\n1\n", "row 3, column 'torque_ratio': the cell is missing"),
        ("speed_ratio,torque_ratio\n0,1\n1,nan\n", "row 3, column 'torque_ratio': must be a finite number"),
        ("speed_ratio,torque_ratio\n0,1\n1,2\n1,3\n", "row 4, column 'speed_ratio': must increase, got 1.0"),
        ("speed_ratio,speed_ratio\n0,1\n1,2\n", "one column 'speed_ratio'"),
    ],
)
def test_a_bad_table_names_row_and_column(tmp_path: Path, table: str, words: str) -> None:
    path = written(tmp_path, HOIST, table)
    message = complaint(path)
    assert words in message
    assert message.startswith(f"{path}: line {line_of(HOIST, '  f_t')}: tables.f_t")


def test_a_table_behind_a_link_out_of_the_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    path = written(tmp_path / "in", HOIST)
    (tmp_path / "out.csv").write_text(CONVERTER)
    (tmp_path / "in" / "converter.csv").unlink()
    (tmp_path / "in" / "converter.csv").symlink_to(tmp_path / "out.csv")
    assert "must lie in the folder" in complaint(path)


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
