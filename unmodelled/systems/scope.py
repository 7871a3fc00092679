"""Names that an expression can use, with their units and sizes."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

import sympy as sp

from unmodelled.systems.model import System
from unmodelled.systems.quantities import UNKNOWN, Quantity
from unmodelled.systems.sizes import measured


@dataclass(frozen=True)
class Value:
    """Expression with its unit and the size of its tree.

    Attributes:
        expression: SymPy expression.
        quantity: dimension, as far as it is known; default unknown.
        size: number of nodes of the tree; default 1.
        depth: depth of the tree; default 1.
    """

    expression: sp.Expr
    quantity: Quantity = UNKNOWN
    size: int = 1
    depth: int = 1


@dataclass(frozen=True)
class Scope:
    """Names that an expression can use.

    Attributes:
        values: expressions by name.
        tables: number of each table by name; default none.
        states: names that diff() can differentiate by; default none.
        refused: reason by name, for names that exist but are not allowed here; default none.
    """

    values: Mapping[str, Value]
    tables: Mapping[str, int] = field(default_factory=dict)
    states: Collection[str] = ()
    refused: Mapping[str, str] = field(default_factory=dict)


def scope_of(system: System) -> Scope:
    """Return the scope of all names of a system.

    Args:
        system: system to take the names from.

    Returns:
        Scope of its states, inputs, constants, parameters, efforts, signals and tables.
    """
    symbols = (*system.x, *system.u, *system.c, *system.p, *system.e)
    values = {str(s): Value(s) for s in symbols}
    values |= {name: Value(e, UNKNOWN, *measured(e)) for name, e in system.signals.items()}
    tables = {table.name: k for k, table in enumerate(system.tables)}
    return Scope(values, tables, [s.name for s in system.states])
