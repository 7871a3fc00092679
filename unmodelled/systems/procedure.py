"""Long calculations as one function of an expression: named steps in order, and a result.

The dynamics of a robot take thousands of operations whose intermediate results are used many times. Written
out as one expression they would grow exponentially. A procedure keeps the steps; an expression that calls it
is a function of a few arguments, which can be differentiated and substituted like any other function.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from typing import Any

import sympy as sp

Step = tuple[sp.Symbol, sp.Expr]
Steps = tuple[Step, ...]


class Procedure(sp.AtomicExpr):  # type: ignore[misc]
    """Calculation of one number, without the steps and inputs that do not influence the number.

    Two procedures with the same inputs, steps and result are equal.
    """

    is_commutative = True
    is_real = True

    inputs: tuple[sp.Symbol, ...]
    steps: Steps
    result: sp.Expr
    digest: str
    _slopes: dict[int, Procedure]
    _given: dict[int, Procedure]  # slopes that were not derived, which another process gets too

    def __new__(cls, inputs: Iterable[sp.Symbol], steps: Iterable[Step], result: sp.Expr) -> Procedure:
        kept, needed = [], set(_symbols(result))
        for symbol, step in reversed(tuple(steps)):
            if symbol in needed:
                kept.append((symbol, step))
                needed |= _symbols(step)
        self: Procedure = super().__new__(cls)
        self.inputs = tuple(x for x in inputs if x in needed)
        self.steps = tuple(reversed(kept))
        self.result = result
        names = (x.name for x in self.inputs)
        texts = (*names, *(f"{s.name}={_text(e)}" for s, e in self.steps), _text(result))
        self.digest = hashlib.sha256("\0".join(texts).encode()).hexdigest()
        self._slopes, self._given = {}, {}
        return self

    def __getnewargs__(self) -> tuple[Any, ...]:
        return self.inputs, self.steps, self.result

    def __reduce_ex__(self, protocol: Any) -> tuple[Any, ...]:
        return _with_slopes, (self.inputs, self.steps, self.result, self._given)

    def _hashable_content(self) -> tuple[str]:
        return (self.digest,)

    def _sympystr(self, printer: Any) -> str:
        return f"procedure_{self.digest[:12]}"

    def _sympyrepr(self, printer: Any) -> str:
        return f"Procedure('{self.digest}')"

    def slope(self, k: int) -> Procedure:
        """Return the procedure of the derivative of the result by one input."""
        if k not in self._slopes:
            x = self.inputs[k]
            steps, slopes = list[Step](), {x: sp.S.One}
            for symbol, step in self.steps:
                steps.append((symbol, step))
                slope = _chained(step, slopes)
                if is_simple(slope):
                    slopes[symbol] = slope
                elif slope != 0:
                    slopes[symbol] = sp.Symbol(f"{symbol}'{x}", real=True)
                    steps.append((slopes[symbol], slope))
            found: Procedure = Procedure(self.inputs, steps, _chained(self.result, slopes))
            self._slopes[k] = found
        return self._slopes[k]

    def give_slope(self, k: int, slope: Procedure) -> None:
        """Set the procedure of the derivative of the result by one input, where a shorter one is known."""
        self._slopes[k] = self._given[k] = slope


class evaluated(sp.Function):  # type: ignore[misc]
    """Result of a procedure (first argument) for values of its inputs (further arguments)."""

    is_real = True

    @classmethod
    def at(cls, procedure: Procedure, values: Mapping[sp.Symbol, sp.Expr]) -> sp.Expr:
        """Return the result of a procedure as an expression."""
        if not procedure.steps and is_simple(procedure.result):
            return procedure.result.xreplace(dict(values))
        return cls(procedure, *(values[x] for x in procedure.inputs))

    def _eval_derivative(self, s: sp.Symbol) -> sp.Expr:
        procedure, *given = self.args
        values = dict(zip(procedure.inputs, given, strict=True))
        inner = [(k, sp.diff(value, s)) for k, value in enumerate(given)]
        return sp.Add(*(evaluated.at(procedure.slope(k), values) * d for k, d in inner if d != 0))


def _with_slopes(
    inputs: Iterable[sp.Symbol], steps: Iterable[Step], result: sp.Expr, slopes: Mapping[int, Procedure]
) -> Procedure:
    """A procedure of another process, with the slopes that were given to it."""
    found: Procedure = Procedure(inputs, steps, result)
    for k, slope in slopes.items():
        found.give_slope(k, slope)
    return found


def is_simple(expression: sp.Expr) -> bool:
    """Return whether an expression needs no step of its own: a number, a symbol, or one times the other."""
    factors = expression.args if expression.is_Mul else (expression,)
    if not all(factor.is_Symbol or factor.is_Number for factor in factors):
        return False
    return len(factors) == 1 or (len(factors) == 2 and bool(factors[0].is_Number))


def expanded(expressions: Sequence[sp.Expr]) -> tuple[list[Step], list[sp.Expr]]:
    """Return expressions without calls of procedures, and the steps that they use."""
    expansion = _Expansion()
    results = [expansion(e) for e in expressions]
    return expansion.steps, results


def common_parts(expressions: Sequence[sp.Expr], **how: Any) -> tuple[list[Step], list[sp.Expr]]:
    """Return common parts of expressions like `sympy.cse`, and calls of procedures as their steps."""
    steps, rest = expanded(list(expressions))
    parts, results = sp.cse(rest, **how)
    return [*steps, *parts], results


class _Expansion:
    def __init__(self) -> None:
        self.steps: list[Step] = []
        self._names: dict[sp.Expr, sp.Symbol] = {}
        self._done: dict[sp.Expr, sp.Expr] = {}
        self._scopes: list[dict[sp.Symbol, sp.Expr]] = []

    def __call__(self, e: sp.Expr) -> sp.Expr:
        if e not in self._done:
            self._done[e] = self._made(e) if e.has(evaluated) else e
        return self._done[e]

    def _made(self, e: sp.Expr) -> sp.Expr:
        if not isinstance(e, evaluated):
            return e.func(*map(self, e.args))
        procedure, *given = e.args
        values = {x: self._named(self(v)) for x, v in zip(procedure.inputs, given, strict=True)}
        scope = scope_for(values, self._scopes)
        for symbol, step in procedure.steps:
            if symbol not in scope:
                scope[symbol] = self._named(step.xreplace(scope))
        return procedure.result.xreplace(scope)

    def _named(self, e: sp.Expr) -> sp.Expr:
        if is_simple(e):
            return e
        if e not in self._names:
            # no name of a system file begins with _
            self._names[e] = sp.Symbol(f"_step_{len(self.steps)}", real=True)
            self.steps.append((self._names[e], e))
        return self._names[e]


def scope_for(values: Mapping[sp.Symbol, Any], scopes: list[dict[sp.Symbol, Any]]) -> dict[sp.Symbol, Any]:
    """Return what is known for some values of inputs; calls with the same values share their steps."""
    for scope in scopes:
        if all(scope.get(x, value) == value for x, value in values.items()):
            break
    else:
        scopes.append(scope := {})
    scope |= values
    return scope


def _chained(expression: sp.Expr, slopes: Mapping[sp.Symbol, sp.Expr]) -> sp.Expr:
    """Derivative of an expression whose symbols have the given derivatives, the others none."""
    inner = _symbols(expression) & slopes.keys()
    if not inner:
        return sp.S.Zero
    return sp.Add(*(_partial(expression, s) * slopes[s] for s in sorted(inner, key=lambda s: s.name)))


@lru_cache(maxsize=200_000)
def _partial(expression: sp.Expr, s: sp.Symbol) -> sp.Expr:
    """Derivative of an expression; of sums and products, which most steps are, without SymPy's search."""
    if s not in _symbols(expression):
        return sp.S.Zero
    if expression.is_Symbol:
        return sp.S.One
    if expression.is_Add:
        return sp.Add(*(_partial(part, s) for part in expression.args))
    if expression.is_Mul:
        factors = expression.args
        parts = ((k, _partial(factor, s)) for k, factor in enumerate(factors))
        return sp.Add(*(sp.Mul(*factors[:k], part, *factors[k + 1 :]) for k, part in parts if part != 0))
    return sp.diff(expression, s)


@lru_cache(maxsize=200_000)
def _symbols(expression: sp.Expr) -> frozenset[sp.Symbol]:
    return frozenset(expression.free_symbols)


@lru_cache(maxsize=200_000)
def _text(expression: sp.Expr) -> str:
    return str(sp.srepr(expression))
