"""What is written is read back as the same system, and equations are shown as they are meant."""

import math
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest
import sympy as sp
from hypothesis import example, given, settings
from hypothesis import strategies as st

from pipeline.chapters.equations import equations
from tests.machines.folders import system_of
from tests.machines.known import NAMES, built_in, written_again
from unmodelled.systems import functions as f
from unmodelled.systems.model import Constant, Output, State, System, symbol
from unmodelled.systems.operations import FUNCTIONS
from unmodelled.systems.printing import printed
from unmodelled.systems.tables import Table
from unmodelled.systems.writer import write_system

PENDULUM = built_in("pendulum")
RICH = """\
schema: system/1
name: rich
states: {x: {unit: m, initial: -0.125}, v: {unit: m/s}, y: {unit: '1'}}
inputs:
  u: {unit: V, column: 'motor, voltage: 1', delay: 0.0015, commanded: false, hold: true}
outputs:
  x: {column: 'null', unit: m, delay: 0.002}
  F_s: {column: "# force \\"s\\"", unit: N, expression: F_s}
  yes: {unit: '', expression: 'min(y, 0.1, sin(t))'}
operating_point:
  m: {unit: kg}
  c: {unit: '1', values: {run1: 0.30000000000000004, "2": -1e-17, "a: 'b', {c}": 5e-324}, other: -0.5}
parameters:
  k: {value: 123.45678901234567, unit: N/m, identify: true, bounds: [1e-300, 1e+17]}
  kf: {value: -1e-05, unit: N/V}
  n: {value: 0.1, unit: -}
signals:
  F_s: >
    k*x +
    spring(x/0.01)
  a: where(x > 0, F_s, -F_s)/m
  mu: diff(F_s, x)
ports:
  rail: {effort: F_rail, unit: N, position: x, velocity: v, load: F_s, law: 'clip(k*x, -1, 1) + F_s'}
  other: {effort: F_other, unit: N, velocity: v, law: 0}
  rest: {effort: F_rest, unit: N, position: x, kind: balance}
tables:
  spring: {file: s.csv, x: 'deflection [m]', y: force}
  cam: {file: s.csv, x: force, y: 'deflection [m]', kind: linear}
dynamics: {x: v, v: a - (F_rail + F_other + F_rest - kf*u)/m - 9.81*cam(x), y: -0.7*y**2}
events:
  hit: {expression: '0.1 - x', then: {v: -9.81, y: 'min(-0.3*y, 0.1)'}}
  late: {expression: 2.5 - t}
"""


@pytest.fixture
def rich(tmp_path: Path) -> System:
    (tmp_path / "s.csv").write_text("force,deflection [m]\n1,0.1\n2,0.30000000000000004\n4,1e3\n5,1.2e3\n")
    return system_of(RICH, tmp_path)


def test_every_field_survives(rich: System, tmp_path: Path) -> None:
    back = written_again(rich, tmp_path)
    assert back == rich
    assert written_again(back, tmp_path) == rich
    assert rich.text["outputs.yes.expression"] == "min(y, 0.1, sin(t))"
    assert rich.text["ports.other.law"] == "0"


@pytest.mark.parametrize("name", NAMES)
def test_the_systems_that_come_along_survive(name: str, tmp_path: Path) -> None:
    system = built_in(name)
    assert written_again(system, tmp_path) == system


@given(values=st.dictionaries(st.text(min_size=1, max_size=8), st.floats(allow_nan=False), max_size=4))
@example(values={"\u2028\x85\ufeff\ufffe\x00": 1.0, "null": 2.0, "-": 3.0, "<<": 4.0})
@settings(max_examples=80, deadline=None)
def test_values_of_experiments_survive_whatever_their_ids_are(
    tmp_path_factory: pytest.TempPathFactory, values: dict[str, float]
) -> None:
    finite = {name: value for name, value in values.items() if math.isfinite(value)}
    own = Constant("d", "kg", finite, 1.5, identify=True, bounds=(1.0, 2.5))
    constants = (Constant("c", "kg", finite, 1.5), own)
    system = replace(PENDULUM, operating_point=constants)
    assert written_again(system, tmp_path_factory.getbasetemp()).operating_point == constants


def test_without_text_expressions_are_printed(tmp_path: Path) -> None:
    system = built_in("slider_crank")
    back = written_again(replace(system, text={}), tmp_path)
    assert set(back.text) == set(system.text)
    values = dict(zip(system.p, system.values, strict=True)) | dict.fromkeys((*system.u, *system.e), 0.3)
    values |= {symbol("theta"): 0.7, symbol("omega"): 2.0}
    before, after = (*system.signals.values(), *system.dynamics), (*back.signals.values(), *back.dynamics)
    for old, new in zip(before, after, strict=True):
        assert float(old.subs(values)) == pytest.approx(float(new.subs(values)), rel=1e-12)


def test_an_identified_law_with_memory_is_written_back(tmp_path: Path) -> None:
    omega, z = symbol("omega"), symbol("z")
    law = 0.1 * f.sgn(omega) * f.absolute(omega) ** 0.5 + sp.Rational(1, 3) * z
    law += 2.0 * symbol("b") * f.select(f.greater(omega, z), z, 0)
    port = replace(PENDULUM.ports[0], law=law)
    changed = replace(
        PENDULUM,
        states=(*PENDULUM.states, State("z", "rad/s", sp.Float(0.5))),
        ports=(port,),
        inputs=(replace(PENDULUM.inputs[0], delay=0.01),),
        outputs=(*PENDULUM.outputs, Output("speed", "rad/s", "w", omega + z)),
        dynamics=(*PENDULUM.dynamics, (omega - z) / 0.05),
    ).with_values({"J": 0.1 + 0.2})
    back = written_again(changed, tmp_path)
    assert (back.states, back.inputs, back.parameters) == (changed.states, changed.inputs, changed.parameters)
    assert back.outputs == changed.outputs
    assert back.dynamics[:2] == PENDULUM.dynamics
    at = {omega: 1.7, z: 0.3, symbol("b"): 0.2}
    assert float(back.ports[0].law.subs(at) - law.subs(at)) == pytest.approx(0.0, abs=1e-12)
    new = {"ports.joint.law", "outputs.speed.expression", "dynamics.z"}
    assert set(back.text) - set(PENDULUM.text) == new


def test_initial_values_survive(tmp_path: Path) -> None:
    """A number, an expression and a number that is identified."""
    system = system_of(
        "schema: system/1\nname: tank\nstates:\n  h: {unit: m, initial: 0.5}\n"
        "  s: {unit: m, initial: 2*h + 0.1}\n"
        "  z: {unit: m, initial: {value: 1, identify: true, bounds: [0, 2], per_experiment: true}}\n"
        "inputs:\noutputs:\n  h: {unit: m}\ndynamics: {h: 0, s: 0, z: 0}\n",
        tmp_path,
    )
    number, expression, fitted = (state.initial for state in system.states)
    assert (float(number), expression) == (0.5, 2 * symbol("h") + 0.1)
    assert fitted == symbol("z_0")
    (parameter,) = system.parameters
    found = parameter.name, parameter.unit, parameter.value, parameter.identify, parameter.bounds
    assert found == ("z_0", "m", 1.0, True, (0.0, 2.0))
    back = written_again(system.with_values({"z_0": 1.5}), tmp_path)
    assert [state.initial for state in back.states] == [number, expression, fitted]
    assert back.parameters == (replace(parameter, value=1.5),)


def test_a_text_that_no_longer_says_the_same_is_not_written(tmp_path: Path) -> None:
    law = 2 * symbol("b") * symbol("omega")
    first = written_again(replace(PENDULUM, ports=(replace(PENDULUM.ports[0], law=law),)), tmp_path)
    assert first.text["ports.joint.law"] == "2*b*omega"
    second = written_again(replace(first, ports=(replace(first.ports[0], law=sp.S.Zero),)), tmp_path)
    assert second.ports[0].law == 0
    assert second.text["ports.joint.law"] == "0"


def test_tables_are_written_beside_with_all_digits(tmp_path: Path) -> None:
    table = Table("cam", (0.1 + 0.2, 1.0, 1e300), (-0.0, 1 / 3, 5e-324), "linear")
    law = f.lookup(0, symbol("theta"), 0)
    lawful = replace(PENDULUM, tables=(table,), ports=(replace(PENDULUM.ports[0], law=law),))
    back = written_again(lawful, tmp_path)
    assert back.tables == (table,)
    assert back.ports[0].law == law


x, v = symbol("x"), symbol("v")


@pytest.mark.parametrize(
    ("expression", "text"),
    [
        (f.absolute(x) * f.sgn(v), "abs(x)*sign(v)"),
        (f.step(x) - f.whole(x), "heaviside(x) - floor(x)"),
        (f.minimum(x, f.maximum(v, 1)), "min(x, max(v, 1))"),
        (f.select(f.greater(x, v + 1), x, v), "where((x > (v + 1)), x, v)"),
        (1 - f.equal(x, f.at_least(x, v)), "1 - (x == (x >= v))"),
        (sp.Abs(x) + sp.sign(v), "abs(x) + sign(v)"),
        (sp.Max(x, v), "max(v, x)"),
        (sp.Float(0.1) + x, "x + 0.1"),
        (sp.pi * x, "3.141592653589793*x"),
        (sp.sqrt(x) / 3, "sqrt(x)/3"),
        (x ** sp.Rational(-1, 3), "x**(-1/3)"),
        (f.lookup(1, x, 0), "cam(x)"),
        (f.absolute(f.lookup(1, 2, 0)) + f.sgn(f.lookup(1, 3, 0)), "abs(cam(2)) + sign(cam(3))"),
        (x * f.step(f.lookup(0, 2, 0)), "x*(sign(spring(2))/2 + 1/2)"),
    ],
)
def test_printed(expression: sp.Expr, text: str) -> None:
    assert printed(expression, ("x", "v"), ("spring", "cam")) == text


@pytest.mark.parametrize(
    ("expression", "words"),
    [
        (f.lookup(1, x, 1), "the slope of the table 'cam'"),
        (symbol("w") * x, "cannot name 'w'"),
        (sp.gamma(x), "no function 'gamma'"),
        (sp.Function("foo")(x), "no function 'foo'"),
        (sp.Piecewise((x, x > 0), (0, True)), "no words for Piecewise"),
        (sp.I * x, "no words for ImaginaryUnit"),
        (sp.oo, "no words for Infinity"),
        (sp.Derivative(sp.Function("foo")(x), x), "no words for Derivative"),
        (sp.Add(*(sp.sin(k * x) for k in range(1, 700))), "too long for a system file"),
    ],
)
def test_what_cannot_be_written(expression: sp.Expr, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        printed(expression, ("x", "v"), ("spring", "cam"))


def test_nothing_is_left_behind_when_writing_fails(tmp_path: Path) -> None:
    strange = replace(PENDULUM, ports=(replace(PENDULUM.ports[0], law=symbol("w")),))
    with pytest.raises(ValueError, match="cannot name 'w'"):
        write_system(strange, tmp_path / "a.yaml")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", NAMES)
def test_every_equation_of_a_file_is_shown_as_mathml(name: str) -> None:
    system = built_in(name)
    found = equations(system)
    rates = [system.text[f"dynamics.{s.name}"] for s in system.states]
    assert [e.text for e in found if e.kind == "dynamics"] == rates
    assert len([e for e in found if e.kind == "signal"]) == len(system.signals)
    for equation in found:
        ElementTree.fromstring(equation.mathml)


def test_signals_keep_their_names_and_derivatives_show() -> None:
    ratio = next(e for e in equations(built_in("slider_crank")) if e.text == "diff(d, theta)")
    letters = "".join(ElementTree.fromstring(ratio.mathml).itertext())
    assert letters.startswith("k=") and letters.endswith("d") and "l" not in letters


SHOWN = {
    "asin": "arcsin(x)",
    "atan": "arctan(x)",
    "acos": "arccos(x)",
    "atan2": "arctan(x,y)",
    "exp": "ⅇx",
    "sqrt": "x",
    "abs": "|x|",
    "mod": "(x-y\u2062floor(xy))",
    "clip": "min(max(x,y),z)",
    "where": "where(x,y,z)",
}


THREE = """
schema: system/1
name: three
states: {x: {unit: "1"}, y: {unit: "1"}, z: {unit: "1"}}
outputs: {x: {unit: "1"}}
parameters: {k: {value: 2.0, unit: 1/s}}
tables: {curve: {file: points.csv, x: a, y: b}}
dynamics: {x: "k*(EXPRESSION)", y: 0*k, z: 0*k}
"""


def shown(expression: str, folder: Path) -> str:
    """The letters of an expression of three states and a table."""
    (folder / "points.csv").write_text("a,b\n0,0\n1,1\n2,4\n3,9\n")
    found = equations(system_of(THREE.replace("EXPRESSION", expression), folder))[0]
    letters = "".join(ElementTree.fromstring(found.mathml).itertext())
    return letters.removeprefix("x˙=").replace("k\u2062", "")


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_function_shows_with_its_arguments(name: str, tmp_path: Path) -> None:
    arguments = "x,y,z"[: 2 * FUNCTIONS[name].least - 1]
    assert shown(f"{name}({arguments})", tmp_path) == SHOWN.get(name, f"{name}({arguments})")


@pytest.mark.parametrize(
    ("expression", "letters"),
    [
        ("where(x > y, y, z)", "where((x>y),y,z)"),
        ("where(x <= y, y, z)", "where((y≥x),y,z)"),
        ("where(x != y, y, z)", "where(1-(x=y),y,z)"),
        ("diff(y*curve(x), x)", "y\u2062curve′(x)"),
        ("cos(x)*sign(x)", "cos(x)\u2062sign(x)"),
    ],
)
def test_comparisons_and_tables_show_as_they_are_meant(expression: str, letters: str, tmp_path: Path) -> None:
    assert shown(expression, tmp_path) == letters


def test_what_was_not_written_is_not_shown() -> None:
    assert equations(replace(built_in(NAMES[0]), text={})) == []
