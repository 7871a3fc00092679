"""What is wrong with a system file or its tables is said in one line, with its place."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.physics.system.hoist import CONVERTER, HOIST, changed, complaint, complaints, line_of, written


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
        ("  m: {unit: kg}", "  m: {unit: kg, values: {}}", "values: must have at least one value, or other"),
        ("  m: {unit: kg}", "  m: {unit: kg, values: {a: heavy}}", "values.a: must be a number, got 'heavy'"),
        ("  m: {unit: kg}", "  m: {unit: kg, values: {a: }}", "values.a: must be a number, got nothing"),
        ("  m: {unit: kg}", "  m: {unit: kg, values: {a: 1, a: 2}}", "the key 'a' is written twice"),
        ("  m: {unit: kg}", "  m: {unit: kg, other: 1}", "other: must have values beside it"),
        ("  m: {unit: kg}", "  m: {unit: kg, values: {a: 1}, other: a}", "other: must be a number"),
        ("  m: {unit: kg}", "  m: {unit: kg, identify: true}", "m.identify: must have other beside it"),
        (
            "  m: {unit: kg}",
            "  m: {unit: kg, values: {a: 1}, other: 3, identify: true, bounds: [0, 2]}",
            "m.bounds: must have identify: true beside it, and contain the value of other",
        ),
        (
            "  m: {unit: kg}",
            "  m: {unit: kg, values: {a: 1}, other: 1, bounds: [0, 2]}",
            "m.bounds: must have identify: true beside it",
        ),
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
        ("  v: {unit: m/s} ", "  v: {unit: m/s, initial: fast} ", "states.v.initial: unknown symbol 'fast'"),
        ("  v: {unit: m/s} ", "  v: {unit: m/s, initial: x} ", "states.v.initial: unit must be m/s, got m"),
        (
            "  v: {unit: m/s} ",
            "  v: {unit: m/s, initial: {valeu: 1}} ",
            "v.initial.valeu: unknown key 'valeu'; did",
        ),
        (
            "  v: {unit: m/s} ",
            "  v: {unit: m/s, initial: {identify: true}} ",
            "v.initial: the key 'value' is missing",
        ),
        (
            "identify: true",
            "identify: true, per_experiment: true",
            "parameters.b: only initial values may use 'b', which every experiment has for itself",
        ),
        (
            "  v: {unit: m/s} ",
            "  v: {unit: m/s, initial: {value: 0, per_experiment: true}} ",
            "v.initial.per_experiment: such a number is fitted: add identify: true",
        ),
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
        ("(F_m - b*v - F_rail)/M", "(F_m - b*x - F_rail)/M", "units differ: 'F_m' is in N, 'b*x' in N s"),
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
        (
            "  x: {column: x, unit: m} ",
            "  y: {column: x, unit: m} ",
            "outputs.y: no state has this name: give an expression",
        ),
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
        ("velocity: v}", "kind: balance, velocity: v}", "a balance has no velocity: remove this key"),
        ("velocity: v}", "kind: heat}", "ports.rail.kind: must be power or balance, got 'heat'"),
        (
            "velocity: v}",
            "velocity: v, load: F}",
            "ports.rail.load: must be an input, a state or a signal, got",
        ),
        ("velocity: v}", "velocity: v, load: v}", "ports.rail.load: unit must be N, got m/s"),
        ("velocity: v}", "velocity: v, law: b*v + F_rail}", "law: the effort 'F_rail' is not allowed here"),
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
        ("  x: {column: x, unit: m}", "  x:\n    column: x\n    unit: cmm", "    unit: cmm"),
    ],
)
def test_the_line_is_the_right_one(tmp_path: Path, old: str, new: str, part: str) -> None:
    text = changed(old, new)
    path = written(tmp_path, text)
    assert complaint(path).startswith(f"{path}: line {line_of(text, part)}: ")


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
        ("speed_ratio,torque_ratio\n0,1\n", "at least 2 rows of numbers, got 1"),
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
    ("changes", "words"),
    [
        (
            {"value: 8.5": "value: heavy", "V, column: u": "V, colum: u", "unit: N/V": "unit: lbf/V"},
            [
                "inputs.u.colum: unknown key 'colum'",
                "parameters.M.value: must be a number",
                "parameters.kf.unit: 'lbf/V'",
            ],
        ),
        (
            # what uses a signal with a fault is no fault
            {"  F_m: kf*u": "  F_m: kf*q\n  F_n: 2*F_m\n  F_o: drag(v)"},
            ["signals.F_m: unknown symbol 'q'", "signals.F_o: "],
        ),
        (
            {
                "  x: v\n": "  x: b\n",
                "x: {column: x, unit: m} ": "x: {column: x, unit: s} ",
                "/M - 9.81": "/M - w",
            },
            ["dynamics.x: unit must be", "dynamics.v: unknown symbol 'w'", "outputs.x: unit must be s"],
        ),
        (
            {
                "position: x, velocity: v": "position: y, velocity: v",
                "tables:": "events: {off: {expression: M}}\ntables:",
            },
            [
                "ports.rail.position: must be a state or a signal",
                "events.off.expression: depends on no state",
            ],
        ),
        (
            # keys and numbers of all entries
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
        (
            # declarations and expressions; what uses a faulty name is not checked
            {
                "value: 8.5": "value: heavy",
                "  x: v\n": "  x: 2*v + x\n",
                "position: x, velocity: v": "position: x/2, velocity: v",
                "  F_m: kf*u": "  F_m: kf*q",
            },
            [
                "parameters.M.value: must be a number",
                "signals.F_m: unknown symbol 'q'",
                "dynamics.x: unit must be m/s",
                "must be a state or a signal, got the expression 'x/2': name it in signals, and write",
            ],
        ),
    ],
)
def test_independent_faults_are_told_together(
    changes: dict[str, str], words: list[str], tmp_path: Path
) -> None:
    text = HOIST
    for old, new in changes.items():
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    found = complaints(written(tmp_path, text))
    assert len(found) == len(words), found
    for said, expected in zip(found, words, strict=True):
        assert expected in said
