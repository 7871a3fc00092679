"""Generated code and its functions of one number compute what the symbolic equations say."""

import math
import re
from collections.abc import Callable
from dataclasses import replace
from typing import Literal

import numba
import numpy as np
import pytest
import sympy as sp

from tests.machines.known import Array
from tests.physics.kernel.problems import assert_equal, one_state, problem
from tests.physics.kernel.random_systems import CORNERS, SMOOTH, random_structure
from unmodelled.engine.compiled import scalars
from unmodelled.engine.compiled.printer import ScalarPrinter
from unmodelled.engine.compiled.source import source
from unmodelled.engine.compiled.structure import Augmented
from unmodelled.engine.free_run import Integration
from unmodelled.systems import functions as f
from unmodelled.systems.model import TIME, symbol
from unmodelled.systems.operations import FUNCTIONS
from unmodelled.systems.tables import Table

SEEDS = range(10)
x, p = symbol("x"), symbol("k")


@pytest.mark.parametrize("seed", [*SEEDS[:2], *(pytest.param(k, marks=pytest.mark.long) for k in SEEDS[2:])])
def test_random_system_equals_reference(seed: int) -> None:
    given = problem(random_structure(seed), windows=19, steps=3, period=0.02, seed=seed)
    assert_equal(given, Integration(0.02, "euler", substeps=1 + seed % 3, hold=1.0))
    assert_equal(given, Integration(0.02, "rk4", substeps=1 + seed % 2))


def test_random_systems_use_every_function() -> None:
    """Of the whitelist of system files: each is in the templates, and each in a system that is drawn."""
    words = set(re.findall(r"[a-z]\w*(?=\()", " ".join((*SMOOTH, *CORNERS))))
    assert words >= set(FUNCTIONS)
    drawn = [random_structure(seed) for seed in SEEDS]
    written = [e for model in drawn for e in (*model.system.closed, *model.inputs)]
    used = {type(a).__name__ for e in written for a in e.atoms(sp.Function)}
    theirs = {"sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "exp", "log"}
    ours = {"sgn", "step", "whole", "greater", "at_least", "equal", "absolute", "minimum", "maximum"}
    assert used == theirs | ours | {"select", "lookup"}


@pytest.mark.parametrize(
    "power",
    [-8, -3, -2, -1, 2, 3, 4, 7, 40, sp.Rational(1, 2), sp.Rational(-5, 2), sp.Rational(1, 3), sp.Float(0.7)],
)
def test_powers(power: sp.Expr) -> None:
    text = ScalarPrinter({x: "x0"}).doprint(x**power)
    for value in (0.3, 1.7):
        assert eval(text, {"math": math, "x0": value}) == pytest.approx(value ** float(power), rel=1e-14)


def test_nothing_that_a_user_wrote_stands_in_the_code() -> None:
    structure = random_structure(1)
    given = structure.system
    names = {s.name for s in (*given.x, *given.p, *given.u, *given.e)}
    named = {symbol(name): symbol(f"zebra_{k}") for k, name in enumerate(sorted(names))}
    marked = _renamed(structure, named)
    text = source(marked)
    assert len(named) > 3
    assert "zebra" not in text
    assert text == source(structure)


def _renamed(structure: Augmented, named: dict[sp.Symbol, sp.Symbol]) -> Augmented:
    def new(name: str) -> str:
        return named.get(symbol(name), symbol(name)).name

    system = structure.system
    groups = {
        group: tuple(replace(part, name=new(part.name)) for part in getattr(system, group))
        for group in ("states", "inputs", "operating_point", "parameters")
    }
    laws = [port.law and port.law.xreplace(named) for port in system.ports]
    known = zip(system.ports, laws, strict=True)
    ports = tuple(replace(port, effort=new(port.effort), law=law) for port, law in known)
    dynamics = tuple(d.xreplace(named) for d in system.dynamics)
    inputs = [tuple(q.xreplace(named) for q in n.inputs) for n in structure.networks]
    networks = tuple(replace(n, inputs=q) for n, q in zip(structure.networks, inputs, strict=True))
    changed = replace(system, **groups, ports=ports, dynamics=dynamics)
    return Augmented(changed, networks, tuple(new(name) for name in structure.trainable))


@pytest.mark.parametrize("kind", ["cubic", "linear"])
def test_tables_and_all_their_derivatives(kind: Literal["cubic", "linear"]) -> None:
    """A piecewise cubic has three derivatives and then none, within the table and beyond its ends."""
    table = Table("curve", (-1.5, -0.5, 0.1, 0.9, 1.3), (0.0, 1.0, 0.2, 1.0, 3.0), kind)
    value = f.lookup(0, x, 0)
    expressions = [sp.diff(value, x, order) for order in range(5)]
    terms = [sp.Rational(1, 2 + k) * e for k, e in enumerate(expressions)]
    made = one_state(sum(terms, p * f.lookup(0, p * x, 0)))
    structure = Augmented(replace(made.system, tables=(table,)), (), ("k",))
    given = problem(structure, windows=40, steps=2, period=0.001)
    assert given.x0.min() < -1.5 and given.x0.max() > 1.3
    assert_equal(given, Integration(0.001, "rk4"))


@pytest.mark.parametrize(
    "expression",
    [
        sp.S.Zero,
        p,
        sp.Float(1e300) * x / sp.Float(1e300),
        TIME * sp.pi + sp.E,
        f.whole(1e5 * x) ** 5 / sp.Float(1e25),
        f.select(f.greater(x, 100), sp.log(x), p * x),
        f.maximum(x, f.maximum(x, p)) + f.minimum(p, f.minimum(x, p)),
        sp.sqrt(x**2) + abs(sp.sin(x)) + sp.sign(x),
    ],
)
def test_odd_expressions(expression: sp.Expr) -> None:
    given = problem(one_state(expression), windows=5, steps=2, period=0.02)
    given.x0[:] = 0.3 + np.abs(given.x0)
    assert_equal(given, Integration(0.02, "rk4"))


Function = Callable[[float], float]


def mapped(function: Function, x: Array) -> Array:
    """`function` of every number, in a loop that is vectorised as in a kernel."""

    @numba.njit(error_model="numpy", fastmath={"contract", "nsz"})
    def loop(x, y):  # type: ignore[no-untyped-def]
        for i in range(len(x)):
            y[i] = function(x[i])

    y = np.empty_like(x)
    loop(x, y)
    return y


@pytest.mark.parametrize(("function", "expected"), [(scalars.sin, np.sin), (scalars.cos, np.cos)])
def test_sine_and_cosine(function: Function, expected: Callable[[Array], Array]) -> None:
    generator = np.random.default_rng(0)
    near = np.arange(-6300, 6300) * np.pi / 4
    wide, narrow = generator.uniform(-1e4, 1e4, 100_000), generator.uniform(-7.0, 7.0, 100_000)
    beside = np.nextafter(near, np.inf), np.nextafter(near, -np.inf)
    x = np.concatenate([wide, narrow, near, *beside, 10.0 ** np.arange(-300.0, 0.0, 3.0), [0.0]])
    assert np.abs(x).max() <= 1e4
    error = np.abs(mapped(function, x) - expected(x))
    assert error.max() < 4e-16
    # and relative, down to the zeros
    assert (error <= 1e-15 * np.abs(expected(x))).all()


def test_nan_stays_nan_and_infinity_has_no_sine() -> None:
    for function in (scalars.sin, scalars.cos, scalars.whole, scalars.absolute):
        assert math.isnan(function(math.nan))
    for function in (scalars.sin, scalars.cos):
        assert math.isnan(function(math.inf)) and math.isnan(function(-math.inf))
    for function in (scalars.minimum, scalars.maximum):
        assert math.isnan(function(math.nan, 1.0)) and math.isnan(function(1.0, math.nan))


@pytest.mark.parametrize("x", [-2.5, -1.0, -1e-300, 0.0, 0.7, 3.0, 1e19, -1e300])
def test_floor_of_any_size(x: float) -> None:
    assert scalars.whole(x) == np.floor(x)


@pytest.mark.parametrize(
    ("found", "expected"),
    [
        ([scalars.sgn(x) for x in (-2.0, 0.0, 3.0)], [-1.0, 0.0, 1.0]),
        ([scalars.step(x) for x in (-2.0, 0.0, 3.0)], [0.0, 0.5, 1.0]),
        ([scalars.greater(x, 1.0) for x in (0.0, 1.0, 2.0)], [0.0, 0.0, 1.0]),
        ([scalars.at_least(x, 1.0) for x in (0.0, 1.0, 2.0)], [0.0, 1.0, 1.0]),
        ([scalars.equal(x, 1.0) for x in (0.0, 1.0, 2.0)], [0.0, 1.0, 0.0]),
        ([scalars.absolute(x) for x in (-2.0, 0.0, 3.0)], [2.0, 0.0, 3.0]),
        ([scalars.minimum(x, 1.0) for x in (0.0, 1.0, 2.0)], [0.0, 1.0, 1.0]),
        ([scalars.maximum(x, 1.0) for x in (0.0, 1.0, 2.0)], [1.0, 1.0, 2.0]),
        ([scalars.select(x, 5.0, 7.0) for x in (-1.0, 0.0, 1.0)], [5.0, 7.0, 5.0]),
    ],
)
def test_corners(found: list[float], expected: list[float]) -> None:
    assert found == expected
