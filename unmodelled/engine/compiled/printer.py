"""SymPy expressions as scalar Python that numba compiles and LLVM vectorises over the lanes of a block."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import sympy as sp
from sympy.printing.pycode import PythonCodePrinter

from unmodelled.systems.procedure import common_parts


class ScalarPrinter(PythonCodePrinter):  # type: ignore[misc]
    """Printer with the names of the functions in `scalars`, and half-integer powers as square roots."""

    def __init__(self, names: Mapping[sp.Symbol, str]) -> None:
        super().__init__({"fully_qualified_modules": True, "allow_unknown_functions": True})
        self._names = names

    def _print_Symbol(self, expr: sp.Symbol) -> str:
        return self._names.get(expr, expr.name)

    _print_Dummy = _print_Symbol

    def _print_sin(self, expr: sp.Expr) -> str:
        return f"{expr.func.__name__}({self._print(expr.args[0])})"

    _print_cos = _print_sin

    def _print_lookup(self, expr: sp.Expr) -> str:
        table, x, order = expr.args
        return f"table_{int(table)}_{int(order)}({self._print(x)})"

    def _print_Integer(self, expr: sp.Integer) -> str:
        return f"{int(expr)}.0"

    def _print_Float(self, expr: sp.Expr) -> str:
        return repr(float(expr))

    _print_Rational = _print_NumberSymbol = _print_Float

    def _print_Pow(self, expr: sp.Pow, rational: bool = False) -> str:
        base, exponent = expr.args
        if exponent.is_Rational and (2 * exponent).is_Integer and abs(exponent) <= 16:
            power = abs(int(2 * exponent))
            value = self._power(self._print(base), power)
            return f"(1.0/({value}))" if exponent < 0 else value
        return f"math.pow({self._print(base)}, {self._print(exponent)})"

    @staticmethod
    def _power(base: str, halves: int) -> str:
        """`base` to the power halves / 2."""
        whole = [f"({base})**{halves // 2}"] if halves > 3 else [f"({base})"] * (halves // 2)
        root = [f"math.sqrt({base})"] if halves % 2 else []
        return "(" + "*".join(whole + root) + ")"


def assignments(
    expressions: Sequence[sp.Expr], names: Mapping[sp.Symbol, str], fixed: set[sp.Symbol]
) -> tuple[list[str], list[str], list[str]]:
    """Return assignments of common sub-expressions, and the results in terms of them."""
    shared, results = common_parts(expressions, symbols=sp.numbered_symbols("_"), optimizations="basic")
    printer = ScalarPrinter(names)
    same, lane = set(fixed), []
    before = []
    for name, expression in shared:
        line = f"{name} = {printer.doprint(expression)}"
        if expression.free_symbols <= same:
            same.add(name)
            before.append(line)
        else:
            lane.append(line)
    return before, lane, [printer.doprint(e) for e in results]
