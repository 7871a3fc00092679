"""Printer of SymPy expressions as text that the grammar of system files reads back."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from functools import reduce
from typing import Any

import sympy as sp
from sympy.printing.precedence import PRECEDENCE
from sympy.printing.str import StrPrinter

from unmodelled.systems import functions as f
from unmodelled.systems.operations import FUNCTIONS
from unmodelled.systems.robot.model import RobotModel
from unmodelled.systems.syntax import LONGEST

#: Names in a file of functions with corners; SymPy's own are those of a table at a number, whose value it
#: does not know.
NAMES = {
    **{f.absolute: "abs", f.sgn: "sign", f.step: "heaviside", f.whole: "floor", f.select: "where"},
    **{f.minimum: "min", f.maximum: "max"},
    **{sp.Abs: "abs", sp.sign: "sign", sp.Heaviside: "heaviside", sp.floor: "floor"},
}
_COMPARISONS = {f.greater: ">", f.at_least: ">=", f.equal: "=="}


def printed(
    expression: sp.Expr, names: Collection[str], tables: Sequence[str], robot: RobotModel | None = None
) -> str:
    """Return an expression as text of a system file, with numbers in full precision."""
    expression = f.sanitised(expression)
    expression = expression.replace(sp.Min, lambda *parts: reduce(f.minimum, parts))
    expression = expression.replace(sp.Max, lambda *parts: reduce(f.maximum, parts))
    strange = sorted({str(s) for s in expression.free_symbols} - {*names, "t"})
    if strange:
        raise ValueError(f"a system file cannot name {strange[0]!r} here")
    text = str(_Printer(tables, robot).doprint(expression))
    if len(text) > LONGEST:
        raise ValueError(
            f"an expression of {len(text)} characters is too long for a system file, max. {LONGEST}"
        )
    return text


class _Printer(StrPrinter):  # type: ignore[misc]
    def __init__(self, tables: Sequence[str], robot: RobotModel | None) -> None:
        super().__init__()
        self.tables, self.robot = tables, robot

    def _print_Float(self, expr: Any) -> str:
        return repr(float(expr))

    _print_NumberSymbol = _print_Exp1 = _print_Pi = _print_Float

    def _print_Function(self, expr: Any) -> str:
        if expr.func in _COMPARISONS:
            left, right = (self.parenthesize(a, PRECEDENCE["Add"]) for a in expr.args)
            return f"({left} {_COMPARISONS[expr.func]} {right})"
        if expr.func is f.lookup:
            return self._table(*expr.args)
        name = NAMES.get(expr.func, expr.func.__name__)
        if name not in FUNCTIONS:
            raise ValueError(f"a system file has no function {name!r}")
        if expr.func is f.minimum and expr.args[0].func is f.maximum:
            return f"clip({self.stringify((*expr.args[0].args, expr.args[1]), ', ')})"
        arguments = expr.args[:1] if expr.func is sp.Heaviside else expr.args
        return f"{name}({self.stringify(arguments, ', ')})"

    _print_Abs = _print_Heaviside = _print_Function

    def _print_evaluated(self, expr: Any) -> str:
        function = self.robot.function(expr) if self.robot is not None else None
        if function is None:
            raise ValueError("a system file has no words for a derivative of the motion of a robot")
        return f"{function.name}({self.stringify(function.written(expr), ', ')})"

    def _table(self, table: sp.Integer, x: sp.Expr, order: sp.Integer) -> str:
        if order != 0:
            raise ValueError(f"a system file cannot write the slope of the table {self.tables[int(table)]!r}")
        return f"{self.tables[int(table)]}({self._print(x)})"

    def emptyPrinter(self, expr: Any) -> str:
        raise ValueError(f"a system file has no words for {type(expr).__name__}")

    _print_ImaginaryUnit = _print_Piecewise = _print_Relational = _print_Derivative = emptyPrinter
    _print_Infinity = _print_NegativeInfinity = _print_ComplexInfinity = _print_NaN = emptyPrinter
