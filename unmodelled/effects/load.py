"""Load of a port: the effort that its gear or screw carries, with which the friction there grows."""

from __future__ import annotations

from contextlib import suppress

import sympy as sp

from unmodelled.effects.motion import acceleration, mobility
from unmodelled.systems.model import Port, System, symbol
from unmodelled.systems.printing import printed

#: Characters of a text that is longer than a line of a system file.
LINE = 200


def load(system: System, port: Port) -> tuple[str, sp.Expr] | None:
    """Return the load of a port: what the port names as its load, or else the effort of the inputs on it."""
    if port.load is not None:
        return port.load, system.expression(port.load)
    drive = _drive(system, port)
    if drive == 0:
        return None
    known = next((name for name, signal in system.signals.items() if signal == drive), None)
    with suppress(ValueError):
        return known or _text(system, drive), drive
    return None


def _drive(system: System, port: Port) -> sp.Expr:
    """Sum of the terms with inputs in the balance of efforts at a port."""
    zero = {symbol(p.effort): sp.S.Zero for p in system.ports}
    beta = mobility(system, port)
    if beta == 0 or not beta.free_symbols <= {*system.p, *system.c}:
        return sp.S.Zero
    free = acceleration(system, port, [f.xreplace(zero) for f in system.dynamics])
    # of -1/(M + m) the inverse is written -M - m, and does not cancel
    rates = sp.Add.make_args(free)
    balance = min([r / -beta for r in rates], [-(r / beta) for r in rates], key=sp.count_ops)
    terms = [term for part in balance for term in sp.Add.make_args(part)]
    return sp.Add(*(term for term in terms if term.free_symbols & {*system.u}))


def carries(system: System, port: Port) -> bool:
    """Return whether a port has a load that a system file has words for; takes less time than `load`."""
    if port.load is not None:
        return True
    drive = _drive(system, port)
    with suppress(ValueError):
        return drive != 0 and bool(printed(drive, *_names(system)))
    return False


def _names(system: System) -> tuple[list[str], list[str]]:
    """Names of quantities and tables."""
    names = [str(s) for s in (*system.x, *system.u, *system.p, *system.c)]
    return names, [table.name for table in system.tables]


def _text(system: System, expression: sp.Expr) -> str:
    """Text of a load; one that is longer than a line has the signals of the system by name."""
    names, tables = _names(system)
    if sp.count_ops(expression) > LINE or len(text := printed(expression, names, tables)) > LINE:
        # a signal is made of earlier ones, and `subs` finds it among other factors and terms too
        for name, signal in reversed([*system.signals.items()]):
            expression = expression.subs(signal, symbol(name)) if signal.args else expression
        text = printed(expression, [*names, *system.signals], tables)
    return f"({text})" if isinstance(expression, sp.Add) else text
