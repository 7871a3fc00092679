"""The equations of a system as a page shows them: MathML, signals kept under their names."""

from __future__ import annotations

import html
import re
from dataclasses import dataclass, replace

import sympy as sp
from sympy.core.function import AppliedUndef
from sympy.printing.mathml import MathMLPresentationPrinter

from pipeline.physics.system.grammar import parse
from pipeline.physics.system.model import System, symbol
from pipeline.physics.system.scope import Value, scope_of


@dataclass(frozen=True)
class Equation:
    """One equation.

    Attributes:
        kind: "signal", "law", "dynamics", "output", "event" (what is zero then) or "then" (dynamics after).
        text: as written in the file.
        mathml: presentation MathML.
    """

    kind: str
    text: str
    mathml: str


def equations(system: System) -> list[Equation]:
    """Signals, known laws, dynamics, outputs and events of `system`, in the order of the file.

    What has no text, because it was not read from a file, is left out.
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
    found = []
    for place, (kind, name) in left.items():
        if place in system.text:
            text = system.text[place]
            right = parse(text, scope, place)
            body = f"{_PRINTER.doprint(name)}<mo>=</mo>{_PRINTER.doprint(right)}"
            found.append(Equation(kind, text, f'<math display="block"><mrow>{body}</mrow></math>'))
    return found


class _Rate(sp.Function):  # type: ignore[misc]
    """The time derivative of a state."""


class _Printer(MathMLPresentationPrinter):  # type: ignore[misc]
    """Prints functions of the states by their names alone, and the rate of a state with a dot."""

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

    def _print_sgn(self, e: sp.Expr) -> object:
        return self._print(sp.Function("sign")(e.args[0]))

    def doprint(self, expr: sp.Expr) -> str:
        # XML knows no entities of MathML like &InvisibleTimes;
        return re.sub(
            r"&(?!(?:lt|gt|amp|quot);)\w+;", lambda m: html.unescape(m[0]), self._print(expr).toxml()
        )


_PRINTER = _Printer()
