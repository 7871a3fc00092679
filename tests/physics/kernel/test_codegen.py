"""Generated code computes what the symbolic equations say."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import Literal

import numpy as np
import pytest
import sympy as sp

from tests.physics.kernel.problems import assert_equal, problem
from tests.physics.kernel.random_systems import CORNERS, SMOOTH, random_structure
from unmodelled.engine.compiled.printer import ScalarPrinter
from unmodelled.engine.compiled.source import source
from unmodelled.engine.compiled.structure import Augmented
from unmodelled.engine.free_run import Integration
from unmodelled.systems import functions as f
from unmodelled.systems.model import TIME, Parameter, Port, State, System, symbol
from unmodelled.systems.operations import FUNCTIONS
from unmodelled.systems.tables import Table

SEEDS = range(10)
x, p, F = symbol("x"), symbol("k"), symbol("F")


@pytest.mark.parametrize("seed", [*SEEDS[:3], *(pytest.param(k, marks=pytest.mark.long) for k in SEEDS[3:])])
def test_random_system_equals_reference(seed: int) -> None:
    given = problem(random_structure(seed), windows=19, steps=3, period=0.02, seed=seed)
    assert_equal(given, Integration(0.02, "euler", substeps=1 + seed % 3, hold=1.0))
    assert_equal(given, Integration(0.02, "rk4", substeps=1 + seed % 2))


def test_random_systems_use_every_function() -> None:
    """Of the whitelist of system files: each is in the templates, and each in a system that is drawn."""
    words = set(re.findall(r"[a-z]\w*(?=\()", " ".join((*SMOOTH, *CORNERS))))
    assert words >= set(FUNCTIONS)
    drawn = [random_structure(seed) for seed in SEEDS]
    used = {
        type(a)
        for model in drawn
        for e in (*model.system.closed, *model.inputs)
        for a in e.atoms(sp.Function)
    }
    theirs = {
        sp.sin,
        sp.cos,
        sp.tan,
        sp.asin,
        sp.acos,
        sp.atan,
        sp.atan2,
        sp.sinh,
        sp.cosh,
        sp.tanh,
        sp.exp,
        sp.log,
    }
    ours = {
        f.sgn,
        f.step,
        f.whole,
        f.greater,
        f.at_least,
        f.equal,
        f.absolute,
        f.minimum,
        f.maximum,
        f.select,
    }
    assert used == theirs | ours | {f.lookup}


def system(expression: sp.Expr, value: float = 1.0) -> Augmented:
    """x' = expression - F."""
    made = System(
        "one",
        (State("x", "m"),),
        (),
        (),
        (),
        (Parameter("k", "N", value),),
        (Port("end", "F", "m/s", "x"),),
        (),
        {},
        (expression - F,),
    )
    return Augmented(made, (), ("k",))


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
    names = {
        s.name for s in (*structure.system.x, *structure.system.p, *structure.system.u, *structure.system.e)
    }
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
    ports = tuple(
        replace(port, effort=new(port.effort), law=port.law and port.law.xreplace(named))
        for port in system.ports
    )
    dynamics = tuple(d.xreplace(named) for d in system.dynamics)
    networks = tuple(
        replace(n, inputs=tuple(q.xreplace(named) for q in n.inputs)) for n in structure.networks
    )
    changed = replace(system, **groups, ports=ports, dynamics=dynamics)
    return Augmented(changed, networks, tuple(new(name) for name in structure.trainable))


@pytest.mark.parametrize("kind", ["cubic", "linear"])
def test_tables_and_all_their_derivatives(kind: Literal["cubic", "linear"]) -> None:
    """A piecewise cubic has three derivatives and then none, within the table and beyond its ends."""
    table = Table("curve", (-1.5, -0.5, 0.1, 0.9, 1.3), (0.0, 1.0, 0.2, 1.0, 3.0), kind)
    value = f.lookup(0, x, 0)
    expressions = [sp.diff(value, x, order) for order in range(5)]
    made = system(
        sum((sp.Rational(1, 2 + k) * e for k, e in enumerate(expressions)), p * f.lookup(0, p * x, 0))
    )
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
    given = problem(system(expression), windows=5, steps=2, period=0.02)
    given.x0[:] = 0.3 + np.abs(given.x0)
    assert_equal(given, Integration(0.02, "rk4"))
