"""Random text is read or refused, and random expressions have the values of Python's own arithmetic."""

from __future__ import annotations

import math
from typing import Any

import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.physics.system.symbols import NAMES, SCOPE, b, u, v, x
from unmodelled.base.errors import BadInput
from unmodelled.systems.grammar import parse
from unmodelled.systems.model import TIME
from unmodelled.systems.printing import printed

ALPHABET = st.sampled_from(
    [*"xvub t01.9()*/+-<>=!,e'_[]{}:^%", "**", "sin(", "cam(", "diff(", "where(", "exp(", "log("]
)


@given(st.lists(ALPHABET, max_size=40).map("".join))
@settings(max_examples=300, deadline=1000)
def test_random_tokens_are_read_or_refused(text: str) -> None:
    _read_or_refused(text)


@pytest.mark.long
@given(st.text(max_size=60))
@settings(max_examples=200, deadline=1000)
def test_random_text_is_read_or_refused(text: str) -> None:
    _read_or_refused(text)


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
    "sin": math.sin,
    "cos": math.cos,
    "tanh": math.tanh,
    "atan": math.atan,
    "exp": math.exp,
    "atan2": math.atan2,
    "abs": abs,
    "sign": _sign,
    "floor": math.floor,
    "min": min,
    "max": max,
    "mod": lambda a, b: a - b * math.floor(a / b),
    "clip": lambda a, low, high: min(max(a, low), high),
    "heaviside": lambda a: (_sign(a) + 1) / 2,
    "where": lambda c, a, b: a if c else b,
    "cam": lambda a: a / (1 + abs(a)),
    "pi": math.pi,
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
        return st.lists(inner, min_size=count, max_size=count).map(
            lambda parts: f"{name}({', '.join(parts)})"
        )

    one = ("sin", "cos", "tanh", "atan", "abs", "sign", "floor", "heaviside", "cam")
    return st.one_of(
        *(call(name, 1) for name in one),
        *(call(name, 2) for name in ("atan2", "min", "max")),
        *(call(name, 3) for name in ("clip", "where")),
        st.tuples(inner, st.sampled_from("+-*"), inner).map(lambda p: f"({p[0]} {p[1]} {p[2]})"),
        st.tuples(inner, st.sampled_from("+-*"), inner).map(lambda p: f"{p[0]}{p[1]}{p[2]}"),
        st.tuples(inner, inner).map(lambda p: f"{p[0]}/(1.5 + abs({p[1]}))"),
        st.tuples(inner, st.sampled_from([">", "<", ">=", "<="]), inner).map(
            lambda p: f"({p[0]} {p[1]} {p[2]})"
        ),
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
