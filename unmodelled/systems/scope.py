"""What an expression may name, and what is known of it."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

import sympy as sp

from unmodelled.systems.model import System
from unmodelled.systems.quantities import UNKNOWN, Quantity
from unmodelled.systems.sizes import measured


@dataclass(frozen=True)
class Value:
    """An expression, what is known of its unit, and the number of parts and the depth of its tree."""

    expression: sp.Expr
    quantity: Quantity = UNKNOWN
    size: int = 1
    depth: int = 1


@dataclass(frozen=True)
class Scope:
    """What an expression may name.

    Attributes:
        values: by name. tables: name -> number. states: names that diff() may differentiate by.
        refused: names that exist but not here -> why.
    """

    values: Mapping[str, Value]
    tables: Mapping[str, int] = field(default_factory=dict)
    states: Collection[str] = ()
    refused: Mapping[str, str] = field(default_factory=dict)


def scope_of(system: System) -> Scope:
    """States, inputs, constants, parameters, efforts, signals and tables of `system`."""
    symbols = (*system.x, *system.u, *system.c, *system.p, *system.e)
    values = {str(s): Value(s) for s in symbols}
    values |= {name: Value(e, UNKNOWN, *measured(e)) for name, e in system.signals.items()}
    tables = {table.name: k for k, table in enumerate(system.tables)}
    return Scope(values, tables, [s.name for s in system.states])
