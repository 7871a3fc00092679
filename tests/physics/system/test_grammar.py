"""Expressions: what they mean, what is refused, and that nothing takes long; also of random texts."""

import math
import time
from typing import Any

import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from unmodelled.base.errors import BadInput
from unmodelled.systems import functions as f
from unmodelled.systems.grammar import parse
from unmodelled.systems.model import TIME, symbol
from unmodelled.systems.printing import printed
from unmodelled.systems.scope import Scope, Value

NAMES = ("x", "v", "u", "b")
x, v, u, b = map(symbol, NAMES)
SCOPE = Scope({name: Value(symbol(name)) for name in NAMES}, {"cam": 0}, ("x", "v"))


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
        *((text, "empty") for text in ("", "   ")),
        *((text, "is not allowed") for text in ("'text'", '"text"', "f'{x}'", "x\x00", "x \u2028 \u202e v")),
        ("\N{FULLWIDTH LATIN SMALL LETTER X}", "is not allowed"),
        # parts that are named
        *((text, f"'{text}' is not allowed") for text in ("True", "None", "1j", "0x10", "1_000", "1.5.2")),
        *((text, f"'{text}' is not allowed") for text in ("~x", "x, v", "()", "2x")),
        *((f"x {sign} v", f"'{sign}' is not allowed") for sign in ("|", "&", "<<", "@", "and", "in")),
        *((f"{name}(x)", f"unknown function '{name}'") for name in ("eval", "exec", "open")),
        ("x.y", "'.y' is not allowed"),
        ("x.__class__", "'.__class__' is not allowed"),
        ("x[0]", "'[0' is not allowed"),
        ("lambda: 0", "'lambda' is not allowed"),
        ("__import__('os')", "'__import__' is not allowed"),
        ("().__class__.__bases__", "'.__class__.__bases__' is not allowed"),
        ("sin(x)(v)", "'sin(x)' is not a function"),
        ("(x := 1)", "':=' is not allowed"),
        ("x = 1", "'=' is not allowed; write == to compare"),
        ("sin(x=1)", "'=1' is not allowed"),
        ("min(*x)", "'*x' is not allowed"),
        ("min(**x)", "arguments have no names"),
        ("x ^ 2", "'^' is not allowed; write ** for a power"),
        ("x // 2", "'//' is not allowed; use floor(a/b)"),
        ("x % 2", "'%' is not allowed; use mod(a, b)"),
        ("x or v", "'or' is not allowed; use max(a, b)"),
        ("not x", "'not' is not allowed"),
        ("x if v else u", "'if' is not allowed; use where"),
        ("x < v < u", "comparisons cannot be chained"),
        ("[x for x in v]", "'[x' is not allowed"),
        ("{x}", "'{x' is not allowed"),
        ("x; v", "';' is not allowed"),
        *((text, "syntax error") for text in ("012", "x +")),
        ("x v", "syntax error at 'v'"),
        ("(x", "syntax error at '(x'"),
        ("x)", "syntax error at ')'"),
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
        # no value
        *((text, "division by zero") for text in ("1/0", "x/(v - v)", "x/floor(0.5)", "x/(0.1 - 0.1)")),
        *((text, "no finite real value") for text in ("0**-1", "0**x", "(-2)**x", "(-2)**0.5")),
        *((text, "no finite real value") for text in ("sqrt(-x**2)", "mod(x, 0)", "mod(1, 0)")),
        *((text, f"'{text}' has no finite real value") for text in ("log(0)", "sqrt(-1)", "asin(2)")),
        ("1e999", "'1e999' is not a finite number"),
        # far too much work
        ("9**9**9**9", "'9**9**9'"),
        *((text, "no finite real value") for text in ("2**(2**1000)", "exp(x + 1e300)*exp(-x)")),
        *((text, "no finite real value") for text in ("(123456*x)**100", "1e200*x*1e200")),
        *((text, "a power above 100") for text in ("((x**99)**99)**99", "x**1e9")),
        ("exp(exp(exp(10)))", "'exp(exp(10))' has no finite real value"),
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


ALPHABET = st.sampled_from(
    [*"xvub t01.9()*/+-<>=!,e'_[]{}:^%", "**", "sin(", "cam(", "diff(", "where(", "exp(", "log("]
)


@pytest.mark.parametrize(
    ("texts", "count"),
    [
        (st.lists(ALPHABET, max_size=40).map("".join), 300),
        pytest.param(st.text(max_size=60), 200, marks=pytest.mark.long),
    ],
)
def test_random_text_is_read_or_refused(texts: st.SearchStrategy[str], count: int) -> None:
    settings(max_examples=count, deadline=1000)(given(texts)(_read_or_refused))()


def _read_or_refused(text: str) -> None:
    try:
        expression = parse(text, SCOPE, "here")
    except BadInput as error:
        assert len(str(error).splitlines()) == 1
    else:
        assert expression.free_symbols <= {x, v, u, b, TIME}
        assert not expression.has(sp.nan, sp.zoo, sp.oo, -sp.oo, sp.I)


def _sign(a: float) -> float:
    return float((a > 0) - (a < 0))


MEANING: dict[str, Any] = {
    **{name: getattr(math, name) for name in ("sin", "cos", "tanh", "atan", "exp", "atan2", "floor", "pi")},
    **{function.__name__: function for function in (abs, min, max)},
    "sign": _sign,
    "mod": lambda a, b: a - b * math.floor(a / b),
    "clip": lambda a, low, high: min(max(a, low), high),
    "heaviside": lambda a: (_sign(a) + 1) / 2,
    "where": lambda c, a, b: a if c else b,
    "cam": lambda a: a / (1 + abs(a)),
}
COMPILED = {
    "absolute": abs,
    "sgn": _sign,
    "step": MEANING["heaviside"],
    "whole": math.floor,
    "minimum": min,
    "maximum": max,
    "select": MEANING["where"],
    "greater": lambda a, b: a > b,
    "at_least": lambda a, b: a >= b,
    "equal": lambda a, b: a == b,
    "lookup": lambda k, a, order: MEANING["cam"](a),
}

atoms = st.one_of(
    st.sampled_from([*NAMES, "t", "pi"]),
    st.integers(0, 9).map(str),
    st.floats(0.01, 9.0).map(lambda a: repr(round(a, 3))),
)


def _compound(inner: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    def call(name: str, count: int) -> st.SearchStrategy[str]:
        parts = st.lists(inner, min_size=count, max_size=count)
        return parts.map(lambda parts: f"{name}({', '.join(parts)})")

    one = ("sin", "cos", "tanh", "atan", "abs", "sign", "floor", "heaviside", "cam")
    return st.one_of(
        *(call(name, 1) for name in one),
        *(call(name, 2) for name in ("atan2", "min", "max")),
        *(call(name, 3) for name in ("clip", "where")),
        st.tuples(inner, st.sampled_from("+-*"), inner).map(lambda p: f"({p[0]} {p[1]} {p[2]})"),
        st.tuples(inner, st.sampled_from("+-*"), inner).map(lambda p: f"{p[0]}{p[1]}{p[2]}"),
        st.tuples(inner, inner).map(lambda p: f"{p[0]}/(1.5 + abs({p[1]}))"),
        st.tuples(inner, st.sampled_from([">", "<", ">=", "<="]), inner).map("({0[0]} {0[1]} {0[2]})".format),
        inner.map(lambda a: f"-{a}"),
        inner.map(lambda a: f"({a})**2"),
        inner.map(lambda a: f"(1 + ({a})**2)**-0.5"),
        inner.map(lambda a: f"mod({a}, 2.5)"),
    )


expressions = st.recursive(atoms, _compound, max_leaves=8)
points = st.tuples(*[st.floats(-2.0, 2.0).map(lambda a: round(a, 4) + 0.00317) for _ in range(5)])


def _compiled(expression: sp.Expr, point: tuple[float, ...]) -> float:
    return float(sp.lambdify([x, v, u, b, TIME], expression, modules=[COMPILED, "math"])(*point))


@pytest.mark.long
@given(text=expressions, point=points)
@settings(max_examples=300, deadline=2000)
def test_text_to_sympy_to_text_keeps_the_value(text: str, point: tuple[float, ...]) -> None:
    """The reference is Python's own arithmetic on the text, which this test itself made."""
    names = dict(zip((*NAMES, "t"), point, strict=True))
    expected = float(eval(text, {"__builtins__": {}}, MEANING | names))
    near = float(eval(text, {"__builtins__": {}}, MEANING | {k: a * (1 + 1e-7) for k, a in names.items()}))
    expression = parse(text, SCOPE, "here")
    again = parse(printed(expression, NAMES, ["cam"]), SCOPE, "here")
    if abs(near - expected) > 1e-3 * (1 + abs(expected)):
        return  # next to a jump, where rounding decides
    assert _compiled(expression, point) == pytest.approx(expected, rel=1e-6, abs=1e-6)
    assert _compiled(again, point) == pytest.approx(expected, rel=1e-6, abs=1e-6)
