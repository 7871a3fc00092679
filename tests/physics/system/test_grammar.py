"""Expressions: what they mean, what is refused, and that nothing takes long."""

from __future__ import annotations

import math
import time

import pytest
import sympy as sp

from tests.physics.system.symbols import SCOPE, b, u, v, x
from unmodelled.base.errors import BadInput
from unmodelled.systems import functions as f
from unmodelled.systems.grammar import parse
from unmodelled.systems.model import TIME, symbol
from unmodelled.systems.scope import Scope, Value


def refused(text: str, scope: Scope = SCOPE) -> str:
    begin = time.perf_counter()
    with pytest.raises(BadInput) as caught:
        parse(text, scope, "a.yaml: line 7: dynamics.v")
    assert time.perf_counter() - begin < 20.0  # refused before it is expanded
    message = str(caught.value)
    assert message.startswith("a.yaml: line 7: dynamics.v: ")
    assert message.isprintable() and len(message) < 400
    return message


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("0", sp.S.Zero),
        ("  x\n + v ", x + v),
        ("-x**2", -(x**2)),
        ("2**-1*x", x / 2),
        ("x**3**2", x**9),
        ("x/v/u", x / (v * u)),
        ("x - v - u", x - v - u),
        ("x - (v - u)*b", x - (v - u) * b),
        ("x/(v*u)*b - +u", x * b / (v * u) - u),
        ("x**2.0 + v**.5", x**2 + sp.sqrt(v)),
        ("x**(1/3)", x ** sp.Rational(1, 3)),
        ("1e-3*x", sp.Float(1e-3) * x),
        ("t*x", TIME * x),
        ("abs(x) + sign(v)", f.absolute(x) + f.sgn(v)),
        ("floor(x) + heaviside(v)", f.whole(x) + f.step(v)),
        ("min(x, v, u)", f.minimum(f.minimum(x, v), u)),
        ("max(x, 0)", f.maximum(x, 0)),
        ("clip(x, v, u)", f.minimum(f.maximum(x, v), u)),
        ("mod(x, v)", x - v * f.whole(x / v)),
        ("where(x > 0, u, v)", f.select(f.greater(x, 0), u, v)),
        ("x < v", f.greater(v, x)),
        ("x <= v", f.at_least(v, x)),
        ("x >= v", f.at_least(x, v)),
        ("x == v", f.equal(x, v)),
        ("x != v", 1 - f.equal(x, v)),
        ("(x > 1)*(v > 1)", f.greater(x, 1) * f.greater(v, 1)),
        ("atan2(x, v)", sp.atan2(x, v)),
        ("diff(x**2*v, x)", 2 * x * v),
        ("diff(abs(x), x)", f.sgn(x)),
        ("diff(cam(x**2), x)", 2 * x * f.lookup(0, x**2, 1)),
        ("cam(2*x)", f.lookup(0, 2 * x, 0)),
        ("x**cam(2)", x ** f.lookup(0, 2, 0)),
        ("exp(cam(2))", sp.exp(f.lookup(0, 2, 0))),
        ("sqrt(x**2)", f.absolute(x)),
        ("max(1, 2) + min(3, 2.5)", sp.Float(4.5)),
        ("(1 > 2) + (2 > 1)", sp.Integer(1)),
        ("0.1 + 0.2", sp.Float(math.fsum([0.1, 0.2]))),
        ("(2 + 1)*x/6", x / 2),
        ("sin(pi/2)", sp.Float(1.0)),
        ("x - x", sp.S.Zero),
    ],
)
def test_what_expressions_mean(text: str, expected: sp.Expr) -> None:
    assert parse(text, SCOPE, "here") == expected


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "empty"),
        ("   ", "empty"),
        ("x.y", "'.y' is not allowed"),
        ("x.__class__", "'.__class__' is not allowed"),
        ("x[0]", "'[0' is not allowed"),
        ("'text'", "is not allowed"),
        ('"text"', "is not allowed"),
        ("f'{x}'", "is not allowed"),
        ("lambda: 0", "'lambda' is not allowed"),
        ("__import__('os')", "'__import__' is not allowed"),
        ("().__class__.__bases__", "'.__class__.__bases__' is not allowed"),
        ("eval(x)", "unknown function 'eval'"),
        ("exec(x)", "unknown function 'exec'"),
        ("open(x)", "unknown function 'open'"),
        ("sin(x)(v)", "'sin(x)' is not a function"),
        ("(x := 1)", "':=' is not allowed"),
        ("x = 1", "'=' is not allowed; write == to compare"),
        ("sin(x=1)", "'=1' is not allowed"),
        ("min(*x)", "'*x' is not allowed"),
        ("min(**x)", "arguments have no names"),
        ("True", "'True' is not allowed"),
        ("None", "'None' is not allowed"),
        ("1j", "'1j' is not allowed"),
        ("0x10", "'0x10' is not allowed"),
        ("1_000", "'1_000' is not allowed"),
        ("012", "syntax error"),
        ("1.5.2", "'1.5.2' is not allowed"),
        ("x | v", "'|' is not allowed"),
        ("x & v", "'&' is not allowed"),
        ("~x", "'~x' is not allowed"),
        ("x ^ 2", "'^' is not allowed; write ** for a power"),
        ("x << 2", "'<<' is not allowed"),
        ("x // 2", "'//' is not allowed; use floor(a/b)"),
        ("x % 2", "'%' is not allowed; use mod(a, b)"),
        ("x @ v", "'@' is not allowed"),
        ("x and v", "'and' is not allowed"),
        ("x or v", "'or' is not allowed; use max(a, b)"),
        ("not x", "'not' is not allowed"),
        ("x if v else u", "'if' is not allowed; use where"),
        ("x in v", "'in' is not allowed"),
        ("x < v < u", "comparisons cannot be chained"),
        ("[x for x in v]", "'[x' is not allowed"),
        ("{x}", "'{x' is not allowed"),
        ("x; v", "';' is not allowed"),
        ("x, v", "'x, v' is not allowed"),
        ("()", "'()' is not allowed"),
        ("x v", "syntax error at 'v'"),
        ("x +", "syntax error"),
        ("(x", "syntax error at '(x'"),
        ("x)", "syntax error at ')'"),
        ("2x", "'2x' is not allowed"),
        ("2(x)", "'2' is not a function"),
        ("x(2)", "'x' is not a function"),
        ("sin", "'sin' is a function: write sin(...)"),
        ("cam + 1", "'cam' is a function"),
        ("sin(x, v)", "'sin' takes 1 argument(s), got 2"),
        ("min(x)", "'min' takes 2 or more argument(s), got 1"),
        ("clip(x)", "'clip' takes 3 argument(s), got 1"),
        ("w", "unknown symbol 'w', must be one of x, v, u, b, t, pi"),
        ("diff(x)", "diff takes 2 arguments"),
        ("diff(x, b)", "the second argument must be a state, got 'b'"),
        ("diff(x, x + v)", "the second argument must be a state"),
        ("\N{FULLWIDTH LATIN SMALL LETTER X}", "is not allowed"),
        ("x\x00", "is not allowed"),
        ("x \u2028 \u202e v", "is not allowed"),
        # no value
        ("1/0", "division by zero"),
        ("x/(v - v)", "division by zero"),
        ("x/floor(0.5)", "division by zero"),
        ("x/(0.1 - 0.1)", "division by zero"),
        ("0**-1", "no finite real value"),
        ("0**x", "no finite real value"),
        ("(-2)**x", "no finite real value"),
        ("(-2)**0.5", "no finite real value"),
        ("log(0)", "'log(0)' has no finite real value"),
        ("sqrt(-1)", "'sqrt(-1)' has no finite real value"),
        ("sqrt(-x**2)", "no finite real value"),
        ("asin(2)", "'asin(2)' has no finite real value"),
        ("mod(x, 0)", "no finite real value"),
        ("mod(1, 0)", "no finite real value"),
        ("1e999", "'1e999' is not a finite number"),
        ("1e200*x*1e200", "no finite real value"),
        # far too much work
        ("9**9**9**9", "'9**9**9'"),
        ("2**(2**1000)", "no finite real value"),
        ("((x**99)**99)**99", "a power above 100"),
        ("x**1e9", "a power above 100"),
        ("exp(exp(exp(10)))", "'exp(exp(10))' has no finite real value"),
        ("exp(x + 1e300)*exp(-x)", "no finite real value"),
        ("(123456*x)**100", "no finite real value"),
        ("9" * 1000, "is not a finite number"),
        ("x" * 9000, "at most 8000 characters"),
        ("1" + "+1" * 1600, "more than 3000 parts"),
        ("(" * 150 + "x" + ")" * 150 + "*(" * 1 + "-" * 60 + "x)", "nested too deeply"),
        ("(" * 3000 + "x" + ")" * 3000, ""),
        ("-" * 7000 + "x", "nested too deeply"),
        ("sin(" * 60 + "x" + ")" * 60, "nested too deeply"),
        ("diff(" + "*".join(f"sin(x+{i})" for i in range(300)) + ", x)", "too large"),
    ],
)
def test_everything_else_is_refused_by_name(text: str, words: str) -> None:
    assert words in refused(text)


def test_long_sums_are_fine() -> None:
    begin = time.perf_counter()
    expression = parse(" + ".join(f"{i}*x**{i % 90}" for i in range(1, 400)), SCOPE, "here")
    assert expression.subs(x, 1) == 399 * 400 // 2
    assert time.perf_counter() - begin < 20.0


def test_names_that_are_not_allowed_here_say_why() -> None:
    scope = Scope({"F": Value(symbol("F"))}, refused={"F": "the effort 'F' is not allowed here"})
    assert refused("2*F", scope).endswith("the effort 'F' is not allowed here")
