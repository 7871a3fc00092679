"""Efforts that depend on the acceleration of their port, without an algebraic loop."""

from __future__ import annotations

from collections.abc import Sequence

import sympy as sp

from unmodelled.effects.motion import acceleration, mobility
from unmodelled.effects.naming import renamed
from unmodelled.effects.substitution import Signals
from unmodelled.systems.model import Port, System, symbol
from unmodelled.systems.printing import printed


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

    Args:
        system: system of the port.
        port: port whose effort grows.
        a: symbol of the acceleration in `terms`.
        terms: pairs of an amplitude and the contribution of one unit of it.
        written: sum of the terms as text, with the name of the free acceleration for a.
        names: names of the free acceleration, the mobility and the total effort.

    Returns:
        Expression and text of the three signals by name; the last one is the total effort.
    """
    effort = symbol(port.effort)
    rates = [f.xreplace({effort: sp.S.Zero}) for f in system.dynamics]
    free, yielding = acceleration(system, port, rates), mobility(system, port)
    total = sum((k * f for k, f in terms), sp.S.Zero)
    rest = 1 - sp.diff(total, a) * symbol(names[1])
    whole = (effort + total.xreplace({a: free})) / rest.xreplace({symbol(names[1]): yielding})
    known = [str(s) for s in rest.free_symbols]
    return {
        names[0]: (free, _written_acceleration(system, port)),
        names[1]: (yielding, ""),
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
