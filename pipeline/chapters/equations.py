"""Equations of a system as MathML, with signals kept under their names."""

from __future__ import annotations

import html
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import sympy as sp
from sympy.core.function import AppliedUndef
from sympy.printing.mathml import MathMLPresentationPrinter

from unmodelled.systems.grammar import parse
from unmodelled.systems.model import System, symbol
from unmodelled.systems.printing import NAMES
from unmodelled.systems.robot.model import RobotModel
from unmodelled.systems.scope import Value, scope_of
from unmodelled.systems.tables import Table


@dataclass(frozen=True)
class Equation:
    """One equation of a system."""

    #: signal, law, dynamics, output, event (expression that is zero at it) or then (dynamics after it)
    kind: str
    text: str  # right-hand side as written in the file
    mathml: str  # whole equation as presentation MathML


def equations(system: System) -> list[Equation]:
    """Return signals, known laws, dynamics, outputs and events of a system as equations.

    Equations that were not read from a file, and so have no text, are left out.
    """
    scope = scope_of(system)
    states = set(system.x)
    # a signal stands for itself, as a function of the states, so that its derivative shows as one
    names = {
        name: Value(sp.Function(name, real=True)(*sorted(e.free_symbols & states, key=str)))
        if e.free_symbols & states
        else Value(symbol(name))
        for name, e in system.signals.items()
    }
    scope = replace(scope, values={**scope.values, **names})
    left = {f"signals.{name}": ("signal", symbol(name)) for name in system.signals}
    left |= {f"ports.{p.name}.law": ("law", symbol(p.effort)) for p in system.ports}
    left |= {f"dynamics.{s.name}": ("dynamics", _Rate(symbol(s.name))) for s in system.states}
    left |= {f"outputs.{o.name}.expression": ("output", symbol(o.name)) for o in system.outputs}
    for event in system.events:
        place = f"events.{event.name}"
        left[f"{place}.expression"] = ("event", sp.S.Zero)
        left |= {f"{place}.then.{s.name}": ("then", _Rate(symbol(s.name))) for s in system.states}
    printer = _Printer(system.tables, system.robot)
    found = []
    for place, (kind, name) in left.items():
        if place in system.text:
            text = system.text[place]
            right = parse(text, scope, place)
            body = f"{printer.doprint(name)}<mo>=</mo>{printer.doprint(right)}"
            found.append(Equation(kind, text, f'<math display="block"><mrow>{body}</mrow></math>'))
    return found


class _Rate(sp.Function):  # type: ignore[misc]
    """Time derivative of a state."""


class _Printer(MathMLPresentationPrinter):  # type: ignore[misc]
    """MathML printer that shows a signal by its name alone and the rate of a state with a dot."""

    def __init__(self, tables: Sequence[Table], robot: RobotModel | None) -> None:
        super().__init__()
        self.tables, self.robot = tables, robot

    def mathml_tag(self, e: object) -> str:
        return NAMES.get(type(e)) or str(super().mathml_tag(e))

    def _print_AppliedUndef(self, e: AppliedUndef) -> object:
        return self._print(sp.Symbol(e.func.__name__))

    def _print__Rate(self, e: sp.Expr) -> object:
        over = self.dom.createElement("mover")
        over.appendChild(self._print(e.args[0]))
        dot = self.dom.createElement("mo")
        dot.appendChild(self.dom.createTextNode("˙"))
        over.appendChild(dot)
        return over

    def _print_absolute(self, e: sp.Expr) -> object:
        return self._print(sp.Abs(e.args[0], evaluate=False))

    def _print_lookup(self, e: sp.Expr) -> object:
        table, x, order = e.args
        return self._called(self.tables[int(table)].name + int(order) * "′", [x])

    def _print_evaluated(self, e: sp.Expr) -> object:
        function = self.robot.function(e) if self.robot is not None else None
        if function is None:
            return self._called("", e.args[1:])
        return self._called(function.name, function.written(e))

    def _called(self, name: str, arguments: Sequence[sp.Expr]) -> object:
        row = self.dom.createElement("mrow")
        row.appendChild(self._print(sp.Symbol(name)))
        row.appendChild(self._paren_comma_separated(*arguments))
        return row

    def _print_greater(self, e: sp.Expr) -> object:
        return self._paren_comma_separated(sp.Gt(*e.args, evaluate=False))

    def _print_at_least(self, e: sp.Expr) -> object:
        return self._paren_comma_separated(sp.Ge(*e.args, evaluate=False))

    def _print_equal(self, e: sp.Expr) -> object:
        return self._paren_comma_separated(sp.Eq(*e.args, evaluate=False))

    def doprint(self, expr: sp.Expr) -> str:
        # XML knows no entities of MathML like &InvisibleTimes;
        text = self._print(expr).toxml()
        return re.sub(r"&(?!(?:lt|gt|amp|quot);)\w+;", lambda m: html.unescape(m[0]), text)
