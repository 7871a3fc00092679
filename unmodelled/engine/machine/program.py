"""Programs of a register machine that runs any system at once, without compiling anything for it.

A system becomes a short program: instructions on registers of `LANES` numbers, free runs side by side with
other starts or other parameters. The interpreter (`loops`) is compiled once; a new structure costs
milliseconds. Where one structure runs for minutes, a generated kernel (`compiled`) is as fast or faster.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import accumulate
from typing import NamedTuple

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from unmodelled.base.arrays import Array, Indices
from unmodelled.engine.free_run import Integration, Sizes, Windows
from unmodelled.engine.machine import loops
from unmodelled.engine.machine.graph import DRIVEN, LANE, STATE, Graph, Segment
from unmodelled.systems.model import TIME, System, symbol
from unmodelled.systems.sticking import STEP_LENGTH, held
from unmodelled.systems.tables import Table


class Places(NamedTuple):
    """Rows of registers and numbers of instructions at which the parts of a program begin."""

    u: int  # first row of the inputs; the states come before
    t: int  # row of the time
    step: int  # row of the length of the integration step, zero where nothing is integrated
    p: int  # first row of the parameters
    c: int  # first row of the constants of the operating point
    numbers: int  # first row of the numbers
    rows: int
    prologue: int  # first instruction of the values that stay the same in a lane
    driven: int  # first instruction of the values that change with time and inputs
    observed: int  # first instruction of the observed values that change with the states
    rates: int  # first instruction of the time derivatives
    end: int  # number of instructions


class Curves(NamedTuple):
    """Tables one after the other."""

    knots: Array  # (knots,), abscissae of all tables
    pieces: Array  # (knots, 4), coefficients of the cubic after every knot
    spans: Indices  # (tables, 2), first and last knot
    ends: Array  # (tables, 2), values beyond the first and the last knot


class Program(NamedTuple):
    """Instructions of the register machine: a backend of `free_run`."""

    at: Places
    code: NDArray[np.uint32]  # (instructions, 6)
    numbers: Array  # (numbers,), constants of the expressions
    curves: Curves
    rates: Indices  # (states,), rows of the time derivatives
    shown: Indices  # (observed,), rows of the observed values

    @classmethod
    def of(cls, system: System, observed: Sequence[sp.Expr]) -> Program:
        """Return the program of a system, with the known laws of its ports."""
        return assembled(Equations.of(system, observed))

    @classmethod
    def of_values(cls, system: System, expressions: Sequence[sp.Expr]) -> Program:
        """Return the program that evaluates expressions of a system, in which all efforts are zero."""
        none = dict.fromkeys(system.e, sp.S.Zero)
        shown = [e.xreplace(none) for e in expressions]
        return assembled(Equations(system.x, system.u, system.p, system.c, [], shown, {}, system.tables))

    @property
    def parameters(self) -> Indices:
        """Indices of the parameters that are read or that are a result, shape (such parameters,)."""
        rows = np.concatenate([self.code[:, 2:5].ravel().astype(np.int64), self.rates, self.shown])
        found = np.unique(rows[(rows >= self.at.p) & (rows < self.at.c)])
        return np.asarray(found - self.at.p)

    @property
    def sizes(self) -> Sizes:
        """Numbers of states, inputs, parameters and constants of the equations."""
        at = self.at
        return Sizes(at.u, at.t - at.u, at.c - at.p, at.numbers - at.c)

    def run(self, windows: Windows, p: Array, c: Array, x0: Array, how: Integration) -> Array:
        """Simulate checked windows; for the shapes of (p, c, x0) see `Backend.run`."""
        if how.method != "rk4":
            raise ValueError(f"the register machine integrates by the method rk4 only, got {how.method}")
        shape = (*x0.shape[:2], int(windows.steps.max(initial=0)) + 1, len(self.shown))
        y = np.full(shape, np.nan)
        hold = np.ascontiguousarray(np.broadcast_to(np.asarray(how.hold, np.float64), windows.u.shape[1]))
        loops.simulate(self, windows, p, c, x0, how.substeps, how.period, hold, y)
        return y

    def evaluate(self, t: Array, x: Array, u: Array, p: Array, c: Array) -> Array:
        """Return the observed values at given states, without integration.

        Args:
            t: time, scalar or shape (...), s; its axes broadcast with the leading axes of the others.
            x: states, shape (..., states), SI.
            u: inputs, shape (..., inputs), SI.
            p: parameters, shape (..., parameters), SI.
            c: constants of the operating points, shape (..., constants), SI.

        Returns:
            Observed values, shape (..., observed), SI.
        """
        parts = [np.asarray(t, np.float64)[..., None], *(np.asarray(a, np.float64) for a in (x, u, p, c))]
        shape = np.broadcast_shapes(*(a.shape[:-1] for a in parts))
        rows = int(np.prod(shape))
        flat = (np.broadcast_to(a, (*shape, a.shape[-1])).reshape(rows, a.shape[-1]) for a in parts)
        y = np.empty((rows, len(self.shown)))
        loops.evaluate(self, *(np.require(a, np.float64, ["C", "W"]) for a in flat), y)
        return y.reshape(*shape, len(self.shown))

    def evaluate_sets(self, t: Array, u: Array, p: Array, c: Array, owner: Indices) -> Array:
        """Return the observed values (samples, sets, observed), SI, of equations without states.

        Takes t (samples,), u (samples, inputs), p (sets, parameters), c (experiments, constants), owner
        (samples,).
        """
        y = np.empty((len(t), len(p), len(self.shown)))
        values = (np.ascontiguousarray(a, np.float64) for a in (t[:, None], u, p, c))
        loops.evaluate_sets(self, *values, np.ascontiguousarray(owner, np.int64), y)
        return y


@dataclass(frozen=True)
class Equations:
    """Equations x' = rates(t, x, u; p, c), and what is observed of them, in SymPy's terms."""

    states: Sequence[sp.Symbol]
    inputs: Sequence[sp.Symbol]
    parameters: Sequence[sp.Symbol]
    constants: Sequence[sp.Symbol]  # constants of the operating point
    rates: Sequence[sp.Expr]
    observed: Sequence[sp.Expr]
    laws: Mapping[sp.Symbol, sp.Expr]  # expressions that other symbols in them stand for
    tables: Sequence[Table]

    @classmethod
    def of(cls, system: System, observed: Sequence[sp.Expr]) -> Equations:
        """Return the equations of a system, with the known laws of its ports and no other efforts."""
        laws = {symbol(port.effort): port.law or sp.S.Zero for port in system.ports}
        return cls(system.x, system.u, system.p, system.c, system.dynamics, observed, laws, system.tables)


def assembled(equations: Equations) -> Program:
    """Return the program of some equations; it is assembled once for equal ones."""
    groups = equations.states, equations.inputs, equations.parameters, equations.constants
    return _assembled(
        tuple(map(tuple, groups)),
        tuple(equations.rates),
        tuple(equations.observed),
        tuple(equations.laws.items()),
        tuple(equations.tables),
    )


@lru_cache(maxsize=256)
def _assembled(
    known: tuple[tuple[sp.Symbol, ...], ...],
    derivatives: tuple[sp.Expr, ...],
    seen: tuple[sp.Expr, ...],
    laws_of: tuple[tuple[sp.Symbol, sp.Expr], ...],
    tables: tuple[Table, ...],
) -> Program:
    states, inputs, parameters, constants = known
    laws = dict(laws_of)
    groups = states, inputs, (TIME,), (STEP_LENGTH,), parameters, constants
    levels = STATE, DRIVEN, DRIVEN, LANE, LANE, LANE
    given = {s: level for group, level in zip(groups, levels, strict=True) for s in group}
    graph = Graph(given, laws)
    closed = tuple(e.xreplace(laws) for e in derivatives)
    integrated = held(states, closed)
    moved = derivatives if integrated == closed else integrated
    rates, shown = ([graph(e) for e in part] for part in (moved, seen))
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
        _curves(tables, list(graph.curves)),
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
