"""Reading system files: what is accepted, and that any other file is refused in one line with its place."""

import re
import time
from pathlib import Path

import pytest
import sympy as sp

from tests.machines.folders import system_of
from tests.machines.known import built_in
from tests.physics.system.hoist import CONVERTER, HOIST, changed, complaint, complaints, line_of, written
from unmodelled.systems.model import Constant, symbol
from unmodelled.systems.reader import read_system


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
    rates = {"dynamics.x": "v", "dynamics.v": "(F_m - b*v - F_rail)/M - 9.81"}
    assert system.text == {"signals.F_m": "kf*u", **rates}


def test_slider_crank_is_the_one_of_chapter_4() -> None:
    """At theta = pi/2 the rod's angle has sin = l1/l2; k = -l1 there (eq. 4.1 differentiated)."""
    system = built_in("slider_crank")
    at = {symbol("theta"): sp.pi / 2, **dict(zip(system.p, system.values, strict=True))}
    assert float(system.signals["k"].subs(at)) == pytest.approx(-0.05)
    assert float(system.signals["k_phi"].subs(at)) == pytest.approx(0.0)


def test_constants_that_the_file_gives_and_an_input_that_is_logged_late(tmp_path: Path) -> None:
    constant = ("  m: {unit: kg}", "  m: {unit: kg, values: {7: 0.5, a b: -1e-3}, other: 2}")
    late = ("column: u}", "column: u, delay: -0.0005}")
    system = read_system(written(tmp_path, changed(constant, late)))
    assert system.operating_point == (Constant("m", "kg", {"7": 0.5, "a b": -0.001}, 2.0),)
    assert system.inputs[0].delay == -0.0005

    # a new experiment has a number of its own
    entries = "{unit: kg, values: {a: 0.5}, other: 0.6, identify: true, bounds: [0.1, 0.9]}"
    system = read_system(written(tmp_path, changed(("  m: {unit: kg}", f"  m: {entries}"))))
    assert system.operating_point == (Constant("m", "kg", {"a": 0.5}, 0.6, identify=True, bounds=(0.1, 0.9)),)


def test_there_may_be_a_value_for_every_experiment_of_a_large_campaign(tmp_path: Path) -> None:
    values = ", ".join(f"run{i}: {i}" for i in range(3000))
    text = changed(("  m: {unit: kg}", f"  m: {{unit: kg, values: {{{values}}}}}"))
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
    system = system_of(
        "schema: system/1\nname: decay\nstates:\n  y: {unit: K, initial: -1e-3}\ninputs:\n"
        "outputs:\n  n: {unit: K, expression: 2*y, delay: 0.01}\n  y: {unit: K}\ndynamics: {y: 0}\n",
        tmp_path,
    )
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
    text = changed(("  F_m: kf*u\n", f"  F_m: kf*u\n  s0: x/0.7\n{grown}"))
    begin = time.perf_counter()
    assert "too large" in complaint(written(tmp_path, text))
    assert time.perf_counter() - begin < 20.0


COLUMNS = "speed_ratio,torque_ratio\n"
UNFITTED = "m.bounds: must have identify: true beside it"
#: Other words for parts of the file of the hoist, and what is said of them.
FAULTS = {
    "schema: system/1": {"schema: system/2": "schema: must start with 'schema: system/1'"},
    "schema: system/1\n": {"": "must start with"},
    "name: hoist\n": {"": "the key 'name' is missing"},
    "name: hoist": {
        "name: 3 hoists": "name: a name is a letter",
        "name:": "name: must be a text, got nothing",
        "name: hoist\nname: crane": "the key 'name' is written twice, first in line 2",
        "name: &a hoist": "anchors",
        "name: !!python/object/apply:os.system [echo]": "the tag 'tag:yaml.org,2002:python/object",
        "name: !!str hoist": "the tag",
        "name: [hoist": "not a YAML file",
        "name: hoist\n? [a, b]\n: c": "a key must be a word",
        "name: hoist\nstate: {}": "unknown key 'state'; did you mean 'states'?",
        "name: hoist\nqqq: {}": "unknown key 'qqq', must be one of schema, name",
    },
    "  m: {unit: kg}": {
        "  m: {unit: kg}\n  m: {unit: kg}": "the key 'm' is written twice",
        "  file: {unit: kg}": "is a column of its own in experiments.csv",
        "  m: {unit: kg, values: [1]}": "values: must be a mapping",
        "  m: {unit: kg, values: {}}": "values: must have at least one value, or other",
        "  m: {unit: kg, values: {a: heavy}}": "values.a: must be a number, got 'heavy'",
        "  m: {unit: kg, values: {a: }}": "values.a: must be a number, got nothing",
        "  m: {unit: kg, values: {a: 1, a: 2}}": "the key 'a' is written twice",
        "  m: {unit: kg, other: 1}": "other: must have values beside it",
        "  m: {unit: kg, values: {a: 1}, other: a}": "other: must be a number",
        "  m: {unit: kg, identify: true}": "m.identify: must have other beside it",
        "  m: {unit: kg, values: {a: 1}, other: 3, identify: true, bounds: [0, 2]}": f"{UNFITTED}, and "
        "contain the value of other",
        "  m: {unit: kg, values: {a: 1}, other: 1, bounds: [0, 2]}": UNFITTED,
        "  m: {unit: kg, value: {a: 1}}": "unknown key 'value'; did you mean 'values'?",
    },
    "  v: {column: v, unit: m/s}": {"  v: *a": "anchors"},
    "  kf: {value": {"\tkf: {value": "a tab; indent with spaces"},
    "  x: v\n": {
        "  x: [[[[[[[[v]]]]]]]]\n": "dynamics.x",
        "  x: v/M\n": "dynamics.x: unit must be m/s, got m/(kg s)",
        "": "dynamics: the state 'x' has no dynamics",
        "  x: v\n  z: v\n": "'z' is not a state, must be one of v, x",
        "  x:\n": "dynamics.x: must be a text, got nothing",
        "  x: __import__('os').system('echo')\n": "dynamics.x: '__import__' is not allowed",
        "  x: w + v\n": "unknown symbol 'w', must be one of",
        "  x: f_t(x, v)\n": "'f_t' takes 1 argument, got 2",
    },
    "  M:  {value": {
        "  1M: {value": "a name is a letter",
        "  F_m: {value": "signals.F_m: the name 'F_m' is taken by the parameter of line",
        "  x: {value": "parameters.x: the name 'x' is taken by the state of line 4",
        **{f"  {name}: {{value": f"the name '{name}' is reserved" for name in ("pi", "t", "clip", "lambda")},
        "  été: {value": "a name is a letter",
    },
    "effort: F_rail": {"effort: u": "the name 'u' is taken by the input"},
    "value: 8.5": {
        "value: heavy": "parameters.M.value: must be a number, got 'heavy'",
        "value: .inf": "must be a number",
        "value: nan": "must be a number, got 'nan'",
        "value: 1e999": "must be a finite number",
        "value: [8.5]": "must be a number, got a list of 1",
    },
    "value: 8.5, ": {"": "the key 'value' is missing"},
    "bounds: [5, 90]": {
        "bounds: [90, 5]": "bounds: must increase, got [90, 5]",
        "bounds: [40, 90]": "must contain the value 31",
        "bounds: [5]": "must be two numbers [low, high]",
        "bounds: [5, .inf]": "bounds[1]: must be a number",
        "bounds: 5": "must be two numbers [low, high], got '5'",
    },
    "identify: true": {
        "identify: yes please": "identify: must be true or false",
        "identfy: true": "unknown key 'identfy'; did you mean 'identify'?",
        "identify: true, per_experiment: true": "parameters.b: only initial values may use 'b', which every "
        "experiment has for itself",
    },
    "unit: V, column: u": {"unit: V, column: u, delay: early": "inputs.u.delay: must be a number"},
    "column: v, unit: m/s": {"column: v, unit: m/s, delay: -0.1": "v.delay: must not be negative"},
    "  v: {unit: m/s} ": {
        "  v: {unit: m/s, initial: fast} ": "states.v.initial: unknown symbol 'fast'",
        "  v: {unit: m/s, initial: x} ": "states.v.initial: unit must be m/s, got m",
        "  v: {unit: m/s, initial: {valeu: 1}} ": "v.initial.valeu: unknown key 'valeu'; did",
        "  v: {unit: m/s, initial: {identify: true}} ": "v.initial: the key 'value' is missing",
        "  v: {unit: m/s, initial: {value: 0, per_experiment: true}} ": "v.initial.per_experiment: such a "
        "number is fitted: add identify: true",
    },
    "column: u}": {"column: t}": "other than the time t"},
    "column: v, unit": {"column: x, unit": "the column 'x' is already an output"},
    "  x: {unit: m}": {
        "  x: {unit: mm}": "states.x.unit: 'mm' must be in SI units, e.g. m instead of mm",
        "  x: {}": "the key 'unit' is missing",
    },
    "unit: N s/m": {
        "unit: furlongs^22": "is not a unit",
        "unit: N q/m": "unknown unit 'q'",
        "unit: __import__('os')": "parameters.b.unit: \"__import__('os')\" is not a unit",
    },
    "(F_m - b*v - F_rail)/M - 9": {"F_m - b*v - F_rail - 9": "dynamics.v: unit must be m/s^2, got N"},
    "(F_m - b*v - F_rail)/M": {"(F_m - b*x - F_rail)/M": "units differ: 'F_m' is in N, 'b*x' in N s"},
    "unit: N, position: x, velocity: v}": {"unit: N, velocity: x}": "must be a power, in W, got N m"},
    "column: v, unit: m/s}": {"column: v, unit: m/s, expression: b*v}": "unit must be m/s, got N"},
    "velocity: v}": {
        "velocity: v, law: M*v}": "ports.rail.law: unit must be N, got",
        "velocity: w}": "ports.rail.velocity: must be a state or a signal, got 'w'",
        "kind: balance, velocity: v}": "a balance has no velocity: remove this key",
        "kind: heat}": "ports.rail.kind: must be power or balance, got 'heat'",
        "velocity: v, load: F}": "ports.rail.load: must be an input, a state or a signal, got",
        "velocity: v, load: v}": "ports.rail.load: unit must be N, got m/s",
        "velocity: v, law: b*v + F_rail}": "law: the effort 'F_rail' is not allowed here",
    },
    "dynamics:                      #": {"dynamic:  #": "unknown key 'dynamic'; did you mean 'dynamics'?"},
    "  x: {column: x, unit: m} ": {
        "  y: {column: x, unit: m} ": "outputs.y: no state has this name: give an expression",
        "  M: {column: x, unit: m} ": "outputs.M: the name 'M' is taken by the parameter",
    },
    "  F_m: kf*u": {
        "  F_m: 2*G\n  G: kf*u": "signals must be in order: 'F_m' uses 'G', which is defined later",
        "  F_m: F_m + u": "cycle in signals: F_m -> F_m",
        "  F_m: G + 1\n  G: H\n  H: F_m": "cycle in signals: F_m -> G -> H -> F_m",
    },
    " - F_rail)/M": {")/M": "effort 'F_rail' of port 'rail' appears in no dynamics"},
    "position: x": {"position: u": "ports.rail.position: must be a state or a signal, got 'u'"},
    "effort: F_rail, ": {"": "ports.rail: the key 'effort' is missing"},
    "file: converter.csv": {
        "file: ../converter.csv": "must lie in the folder",
        "file: /etc/passwd": "must lie in the folder",
        "file: nothing.csv": "'nothing.csv': no such file",
        'file: "a\\0b"': "no such file",
    },
    "x: speed_ratio": {"x: speed": "one column 'speed', got 'speed_ratio', 'torque_ratio'"},
    "kind: cubic}": {"kind: quintic}": "must be cubic or linear, got 'quintic'"},
}


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [(old, new, words) for old, cases in FAULTS.items() for new, words in cases.items()],
)
def test_what_is_wrong_is_said_in_one_line(tmp_path: Path, old: str, new: str, words: str) -> None:
    message = complaint(written(tmp_path, changed((old, new))))
    assert words in message
    assert re.search(r": line \d+: ", message), message


@pytest.mark.parametrize(
    ("old", "new", "part"),
    [
        ("value: 8.5", "value: heavy", "value: heavy"),
        ("  v: (F_m - b*v - F_rail)/M - 9.81", "  v: (F_m - b*v - F_rail)/M - z", "- z"),
        ("  F_m: kf*u", "  F_m: kf*u\n  G: F_m +", "  G:"),
        ("  kf: {value", "\tkf: {value", "\tkf"),
        ("  x: {column: x, unit: m}", "  x:\n    column: x\n    unit: cmm", "    unit: cmm"),
    ],
)
def test_the_line_is_the_right_one(tmp_path: Path, old: str, new: str, part: str) -> None:
    text = changed((old, new))
    path = written(tmp_path, text)
    assert complaint(path).startswith(f"{path}: line {line_of(text, part)}: ")


def test_an_effort_hidden_in_a_signal_is_found(tmp_path: Path) -> None:
    hidden = ("  F_m: kf*u", "  F_m: kf*u\n  F_all: F_m - F_rail")
    message = complaint(written(tmp_path, changed(hidden, ("velocity: v}", "velocity: v, law: F_all}"))))
    assert "'F_all' depends on the effort 'F_rail', which is not allowed here" in message


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ("", "the file is empty"),
        (COLUMNS + "0,1\n", "at least 2 rows of numbers, got 1"),
        (COLUMNS + "0,1\n1,abc\n", "row 3, column 'torque_ratio': must be a number, got 'abc'"),
        (COLUMNS + "0,1\n1\n", "row 3, column 'torque_ratio': the cell is missing"),
        (COLUMNS + "0,1\n1,nan\n", "row 3, column 'torque_ratio': must be a finite number"),
        (COLUMNS + "0,1\n1,2\n1,3\n", "row 4, column 'speed_ratio': must increase, got 1.0"),
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


#: Several other words at once, and what is said of them, one after the other.
TOGETHER = [
    (
        {"value: 8.5": "value: heavy", "V, column: u": "V, colum: u", "unit: N/V": "unit: lbf/V"},
        [
            "inputs.u.colum: unknown key 'colum'",
            "parameters.M.value: must be a number",
            "parameters.kf.unit: 'lbf/V'",
        ],
    ),
    # what uses a signal with a fault is no fault
    (
        {"  F_m: kf*u": "  F_m: kf*q\n  F_n: 2*F_m\n  F_o: drag(v)"},
        ["signals.F_m: unknown symbol 'q'", "signals.F_o: "],
    ),
    (
        {"  x: v\n": "  x: b\n", "column: x, unit: m} ": "column: x, unit: s} ", "/M - 9.81": "/M - w"},
        ["dynamics.x: unit must be", "dynamics.v: unknown symbol 'w'", "outputs.x: unit must be s"],
    ),
    (
        {"position: x, ": "position: y, ", "tables:": "events: {off: {expression: M}}\ntables:"},
        ["ports.rail.position: must be a state or a signal", "events.off.expression: depends on no state"],
    ),
    # keys and numbers of all entries
    (
        {
            "name: hoist\n": "",
            "tables:": "locked: {}\ntables:",
            "unit: V, column: u": "column: u, colour: red",
            "value: 12.0, unit: N/V": "valeu: 12.0",
        },
        [
            "locked: belongs to a robot",
            "the key 'name' is missing",
            "inputs.u.colour: unknown key 'colour'",
            "inputs.u: the key 'unit' is missing: add it; of a number without a unit write unit: 1",
            "parameters.kf.valeu: unknown key 'valeu'; did you mean 'value'?",
            "parameters.kf: the key 'unit' is missing",
        ],
    ),
    # declarations and expressions; what uses a faulty name is not checked
    (
        {
            "value: 8.5": "value: heavy",
            "  x: v\n": "  x: 2*v + x\n",
            "position: x, ": "position: x/2, ",
            "  F_m: kf*u": "  F_m: kf*q",
        },
        [
            "parameters.M.value: must be a number",
            "signals.F_m: unknown symbol 'q'",
            "dynamics.x: unit must be m/s",
            "must be a state or a signal, got the expression 'x/2': name it in signals, and write",
        ],
    ),
]


@pytest.mark.parametrize(("changes", "words"), TOGETHER)
def test_several_faults_are_told_together(changes: dict[str, str], words: list[str], tmp_path: Path) -> None:
    found = complaints(written(tmp_path, changed(*changes.items())))
    assert len(found) == len(words), found
    for said, expected in zip(found, words, strict=True):
        assert expected in said
