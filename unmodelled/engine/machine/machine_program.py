"""Programs of the register machine, made from the equations of a system."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate
from typing import NamedTuple

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from unmodelled.engine.machine.machine_graph import DRIVEN, LANE, STATE, Graph
from unmodelled.engine.machine.machine_registers import Segment
from unmodelled.systems.model import TIME, System, symbol
from unmodelled.systems.tables import Table

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


class Places(NamedTuple):
    """First rows of inputs, time, parameters, constants of the operating point and numbers, and how many rows
    there are; first instructions of the parts of a program.

    prologue: what stays the same in a lane. driven: what changes with time and inputs. observed, rates: what
    changes with the states.
    """

    u: int
    t: int
    p: int
    c: int
    numbers: int
    rows: int
    prologue: int
    driven: int
    observed: int
    rates: int
    end: int


class Curves(NamedTuple):
    """Tables one after the other: knots (N,), coefficients (N, 4), first and last knot and values beyond them
    of every table (tables, 2).
    """

    knots: Array
    pieces: Array
    spans: Indices
    ends: Array


class Program(NamedTuple):
    """What the interpreter runs.

    Attributes:
        at: where it finds what. code: (instructions, 6). numbers: (n,). curves: tables.
        rates, shown: rows of the states' time derivatives and of the observed values.
    """

    at: Places
    code: NDArray[np.uint32]
    numbers: Array
    curves: Curves
    rates: Indices
    shown: Indices

    @property
    def parameters(self) -> Indices:
        """Numbers of the parameters that count: those that an instruction reads, or that are a result."""
        rows = np.concatenate([self.code[:, 2:5].ravel().astype(np.int64), self.rates, self.shown])
        found = np.unique(rows[(rows >= self.at.p) & (rows < self.at.c)])
        return np.asarray(found - self.at.p)


@dataclass(frozen=True)
class Equations:
    """x' = rates(t, x, u; p, c) and what is observed of it, in SymPy's terms.

    Attributes:
        states, inputs, parameters, constants: symbols. rates: one per state. observed: any number.
        laws: what other symbols in them stand for. tables: that they look up.
    """

    states: Sequence[sp.Symbol]
    inputs: Sequence[sp.Symbol]
    parameters: Sequence[sp.Symbol]
    constants: Sequence[sp.Symbol]
    rates: Sequence[sp.Expr]
    observed: Sequence[sp.Expr]
    laws: Mapping[sp.Symbol, sp.Expr]
    tables: Sequence[Table]

    @classmethod
    def of(cls, system: System, observed: Sequence[sp.Expr]) -> Equations:
        """Those of a system, with the known laws of its ports and no other efforts."""
        laws = {symbol(port.effort): port.law or sp.S.Zero for port in system.ports}
        return cls(system.x, system.u, system.p, system.c, system.dynamics, observed, laws, system.tables)


def assembled(equations: Equations) -> Program:
    """The program of some equations.

    Raises:
        ValueError: when they have a symbol or a function that the machine does not know.
    """
    groups = equations.states, equations.inputs, (TIME,), equations.parameters, equations.constants
    levels = STATE, DRIVEN, DRIVEN, LANE, LANE
    given = {s: level for group, level in zip(groups, levels, strict=True) for s in group}
    graph = Graph(given, equations.laws)
    rates, shown = ([graph(e) for e in part] for part in (equations.rates, equations.observed))
    observed, moving = (Segment.of(graph, part, STATE) for part in (shown, rates))
    driven = Segment.of(graph, (*observed.border, *moving.border), DRIVEN)
    lane = Segment.of(graph, driven.border, LANE)
    numbers = {k: value for value, k in graph.constants.items() if k in lane.border}
    segments = lane, driven, observed, moving
    kept = [*graph.symbols.values(), *numbers, *(k for segment in segments for k in segment.roots)]
    rows = {k: row for row, k in enumerate(dict.fromkeys(kept))}
    parts = [segment.instructions(graph, rows, len(rows)) for segment in segments]
    code = [instruction for part, _ in parts for instruction in part]
    symbols = list(accumulate(len(group) for group in groups))
    firsts = list(accumulate((len(part) for part, _ in parts), initial=0))
    return Program(
        Places(*(*symbols, max(end for _, end in parts), *firsts)),
        np.array(code, np.uint32).reshape(-1, 6),
        np.array(list(numbers.values()), np.float64),
        _curves(equations.tables, list(graph.curves)),
        *(np.array([rows[k] for k in part], np.int64) for part in (rates, shown)),
    )


def _curves(tables: Sequence[Table], used: Sequence[tuple[int, int]]) -> Curves:
    knots, pieces, spans, ends = [np.empty(0)], [np.empty((0, 4))], [], []
    for number, order in used:
        x, c = tables[number].pieces(order)
        first = sum(map(len, knots))
        knots.append(x)
        pieces.append(np.concatenate([c.T, np.zeros((1, 4))]))
        spans.append((first, first + len(x) - 1))
        ends.append((0.0, 0.0) if order else (tables[number].y[0], tables[number].y[-1]))
    return Curves(
        np.concatenate(knots),
        np.concatenate(pieces),
        np.array(spans, np.int64).reshape(-1, 2),
        np.array(ends, np.float64).reshape(-1, 2),
    )
