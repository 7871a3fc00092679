"""Names that an expression can use, and limits on its size."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

import sympy as sp

from unmodelled.systems.model import System
from unmodelled.systems.quantities import UNKNOWN, Quantity
from unmodelled.systems.robot.model import MotionFunction

LARGEST = 20_000
DEEPEST_TREE = 150
LARGEST_DERIVATIVE = 4 * LARGEST


@dataclass(frozen=True)
class Value:
    """Expression with its unit and the size of its tree."""

    expression: sp.Expr
    quantity: Quantity = UNKNOWN
    size: int = 1  # number of nodes of the tree
    depth: int = 1  # depth of the tree


@dataclass(frozen=True)
class Scope:
    """Names that an expression can use."""

    values: Mapping[str, Value]
    tables: Mapping[str, int] = field(default_factory=dict)  # number of each table
    states: Collection[str] = ()  # names that diff() can differentiate by
    refused: Mapping[str, str] = field(default_factory=dict)  # reasons for names that are not allowed here
    functions: Mapping[str, MotionFunction] = field(default_factory=dict)  # functions of a robot


def scope_of(system: System) -> Scope:
    """Return the scope of all names of a system."""
    symbols = (*system.x, *system.u, *system.c, *system.p, *system.e)
    values = {str(s): Value(s) for s in symbols}
    values |= {name: Value(e, UNKNOWN, *tree_size(e)) for name, e in system.signals.items()}
    tables = {table.name: k for k, table in enumerate(system.tables)}
    functions = {} if system.robot is None else system.robot.functions
    return Scope(values, tables, [s.name for s in system.states], functions=functions)


def tree_size(expression: sp.Expr) -> tuple[int, int]:
    """Return the number of nodes and the depth of an expression tree."""
    parts, depth, level = 0, 0, [expression]
    while level:
        parts, depth = parts + len(level), depth + 1
        level = [argument for part in level for argument in part.args]
    return parts, depth


def has_large_derivative(expression: sp.Expr) -> bool:
    """Return whether a derivative may have too many nodes, without differentiating."""
    return _sizes(expression)[1] > LARGEST_DERIVATIVE


def _sizes(expression: sp.Expr) -> tuple[int, int]:
    parts = [_sizes(a) for a in expression.args]
    own = 1 + sum(own for own, _ in parts)
    return own, 1 + sum(derived for _, derived in parts) + len(parts) * own
