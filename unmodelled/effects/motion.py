"""Acceleration of a port, the influence of its effort on it, and efforts that depend on it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import sympy as sp

from unmodelled.effects.naming import renamed
from unmodelled.effects.substitution import Signals
from unmodelled.systems.functions import sanitised
from unmodelled.systems.model import Port, System, symbol
from unmodelled.systems.printing import printed
from unmodelled.systems.quantities import number_with_unit


def acceleration(system: System, port: Port, rates: Sequence[sp.Expr]) -> sp.Expr:
    """Return the acceleration of a port for given rates of the states."""
    if port.velocity is None:
        return sp.S.Zero
    return _rate(system.expression(port.velocity), system.x, rates)


def mobility(system: System, port: Port) -> sp.Expr:
    """Return the derivative of a port's acceleration by its effort: minus one over the mass that it feels."""
    if port.velocity is None:
        return sp.S.Zero
    return _mobility(system.expression(port.velocity), system.x, system.dynamics, symbol(port.effort))


@lru_cache(maxsize=256)
def _mobility(
    v: sp.Expr, states: tuple[sp.Symbol, ...], rates: tuple[sp.Expr, ...], effort: sp.Symbol
) -> sp.Expr:
    # asked for every law at a port
    return sanitised(sp.diff(_rate(v, states, rates), effort))


def _rate(v: sp.Expr, states: Sequence[sp.Symbol], rates: Sequence[sp.Expr]) -> sp.Expr:
    return sanitised(sum((sp.diff(v, x) * f for x, f in zip(states, rates, strict=True)), sp.S.Zero))


def is_inertial(system: System, port: Port) -> bool:
    """Return whether a port's acceleration depends linearly on its effort."""
    if port.velocity is None:
        return False
    beta = mobility(system, port)
    moving = system.expression(port.velocity).free_symbols <= {*system.x, *system.p, *system.c}
    return moving and beta != 0 and symbol(port.effort) not in beta.free_symbols


def effort_signals(
    system: System,
    port: Port,
    a: sp.Symbol,
    terms: Sequence[tuple[sp.Expr, sp.Expr]],
    written: str,
    names: Sequence[str],
) -> Signals:
    """Return signals for the effort of a port that depends linearly on the port's acceleration.

    With a = free + mobility*E for any effort E, and E = F + q + r*a, the effort is E = (F + q + r*free) / (1
    - r*mobility). It includes all other ports and laws, also those added later.
    """
    effort = symbol(port.effort)
    rates = [f.xreplace({effort: sp.S.Zero}) for f in system.dynamics]
    free, yielding = acceleration(system, port, rates), mobility(system, port)
    value = ""
    if yielding.is_number:  # a number has to keep the unit of the mobility
        yielding = sp.Float(float(yielding))
        value = number_with_unit(float(yielding))
    total = sum((k * f for k, f in terms), sp.S.Zero)
    rest = 1 - sp.diff(total, a) * symbol(names[1])
    whole = (effort + total.xreplace({a: free})) / rest.xreplace({symbol(names[1]): yielding})
    known = [str(s) for s in rest.free_symbols]
    return {
        names[0]: (free, _written_acceleration(system, port)),
        names[1]: (yielding, value),
        names[2]: (whole, f"({port.effort} + {written})/({printed(rest, known, [])})"),
    }


def _written_acceleration(system: System, port: Port) -> str:
    """Return the acceleration without the effort of the port, as the author of the system would write it."""
    v = system.expression(str(port.velocity))
    parts = []
    for state, x in zip(system.states, system.x, strict=True):
        # 0.0 may have any unit, unlike 0
        rate = renamed(system.text.get(f"dynamics.{state.name}", ""), {port.effort: "0.0"})
        if x in v.free_symbols:
            parts.append(rate if v == x else f"diff({port.velocity}, {state.name})*({rate})")
    return " + ".join(parts)
