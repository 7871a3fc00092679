"""Expressions as a graph of instructions in which equal parts are one node (value numbering).

From the graph to a list of instructions: their order, fused products and sums, and registers.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import groupby
from typing import NamedTuple

import sympy as sp

from unmodelled.engine.machine.opcodes import Op
from unmodelled.systems import functions as f
from unmodelled.systems.procedure import Procedure, evaluated, scope_for

Instruction = tuple[int, int, int, int, int, int]  # opcode, destination, sources a, b and c, table

#: What a node changes with, from seldom to often: nothing or the lane, time and inputs, states.
LANE, DRIVEN, STATE = range(3)

_ALIKE = ("sin", "cos", "exp", "tanh", "log", "asin", "acos", "atan", "atan2", "sinh", "cosh")
_CORNERS = ("sgn", "step", "greater", "at_least", "equal", "select")
ONE_TO_ONE: dict[type[sp.Basic], Op] = {
    **{getattr(sp, name): Op[name.upper()] for name in _ALIKE},
    **{getattr(f, name): Op[name.upper()] for name in _CORNERS},
    **{f.absolute: Op.ABS, f.whole: Op.FLOOR, f.minimum: Op.MIN, f.maximum: Op.MAX},
    **{sp.Abs: Op.ABS, sp.sign: Op.SGN, sp.floor: Op.FLOOR, sp.Min: Op.MIN, sp.Max: Op.MAX},
}
#: Powers up to this are products.
HIGHEST_PRODUCT = 8


class Node(NamedTuple):
    """Instruction, the nodes that it reads and the number of the table that it looks up."""

    op: Op | None  # None for what registers hold from the start
    sources: tuple[int, ...]
    level: int  # LANE, DRIVEN or STATE
    table: int = 0


class Graph:
    """Nodes of all expressions that were asked for; a symbol has a register or stands for a law."""

    def __init__(self, given: Mapping[sp.Symbol, int], laws: Mapping[sp.Symbol, sp.Expr]) -> None:
        self.nodes: list[Node] = []  # sources before what reads them
        self.symbols: dict[sp.Symbol, int] = {}
        self.constants: dict[float, int] = {}
        self.curves: dict[tuple[int, int], int] = {}  # number of each table and order of its derivative
        self._numbers: dict[tuple[Op, tuple[int, ...], int], int] = {}
        self._done: dict[sp.Expr, int] = {}
        self._scopes: list[dict[sp.Expr, int]] = []
        self._laws = laws
        for s, level in given.items():
            self.symbols[s] = self._done[s] = self._append(Node(None, (), level))

    def __call__(self, e: sp.Expr) -> int:
        """The node of an expression."""
        if e not in self._done:
            self._done[e] = self._made(e)
        return self._done[e]

    def constant(self, value: float) -> int:
        """Return the node of a number."""
        if value not in self.constants:
            self.constants[value] = self._append(Node(None, (), LANE))
        return self.constants[value]

    def _made(self, e: sp.Expr) -> int:
        if e.is_Add:
            return self._sum(e.args)
        if e.is_Mul:
            return self._product(e.args)
        if e.is_Pow:
            return self._raised(*e.args)
        if e.is_Symbol and e in self._laws:
            return self(self._laws[e])
        if e.is_Number or e.is_NumberSymbol:
            return self.constant(float(e))
        if e.func is sp.tan:
            return self._op(Op.DIV, self(sp.sin(*e.args)), self(sp.cos(*e.args)))
        if e.func is f.lookup:
            curve = (int(e.args[0]), int(e.args[2]))
            return self._op(Op.LOOKUP, self(e.args[1]), table=self.curves.setdefault(curve, len(self.curves)))
        if e.func is sp.Heaviside:
            return self._op(Op.STEP, self(e.args[0]))
        if e.func is sp.DiracDelta:
            return self.constant(0.0)
        if e.func in (sp.Min, sp.Max):
            return reduce(lambda a, b: self._op(ONE_TO_ONE[e.func], a, b), map(self, e.args))
        if e.func in ONE_TO_ONE:
            return self._op(ONE_TO_ONE[e.func], *map(self, e.args))
        if e.func is evaluated:
            return self._evaluated(*e.args)
        raise ValueError(f"the machine has no instruction for {e}")

    def _evaluated(self, procedure: Procedure, *values: sp.Expr) -> int:
        given = dict(zip(procedure.inputs, map(self, values), strict=True))
        scope = scope_for(given, self._scopes)
        outside, self._done = self._done, scope
        try:
            for symbol, step in procedure.steps:
                if symbol not in scope:
                    scope[symbol] = self(step)
            return self(procedure.result)
        finally:
            self._done = outside

    def _append(self, node: Node) -> int:
        self.nodes.append(node)
        return len(self.nodes) - 1

    def _op(self, op: Op, *sources: int, table: int = 0) -> int:
        key = op, sources, table
        if key not in self._numbers:
            self._numbers[key] = self._append(Node(op, sources, max(map(self._level, sources)), table))
        return self._numbers[key]

    def _fold(self, op: Op, terms: Iterable[int], nothing: int) -> int:
        """Those that change seldom come first, so that their part is one node of that level."""
        ordered = sorted(terms, key=lambda k: (self._level(k), k))
        return reduce(lambda a, b: self._op(op, a, b), ordered) if ordered else nothing

    def _sum(self, terms: Iterable[sp.Expr]) -> int:
        sides: tuple[list[int], list[int]] = ([], [])
        zero = self.constant(0.0)
        for e in terms:
            node, minus = self._signed(e)
            if node != zero:
                sides[minus].append(node)
        added, taken = (self._fold(Op.ADD, side, zero) for side in sides)
        if added == zero:
            return zero if taken == zero else self._op(Op.NEG, taken)
        return added if taken == zero else self._op(Op.SUB, added, taken)

    def _signed(self, e: sp.Expr) -> tuple[int, bool]:
        """The node of a term without its minus sign, and whether it has one."""
        first = e.args[0] if e.is_Mul else e
        if not (first.is_Number and first.is_negative):
            return self(e), False
        return (self._product((-first, *e.args[1:])) if e.is_Mul else self(-e)), True

    def _product(self, factors: Iterable[sp.Expr]) -> int:
        """Divisors that change seldom become reciprocals, which are factors of that level."""
        above: list[int] = []
        below: list[int] = []
        for e in factors:
            if e.is_Pow and e.exp.is_Number and e.exp.is_negative:
                below.append(self._raised(e.base, -e.exp))
            else:
                above.append(self(e))
        if self.constant(0.0) in above:
            return self.constant(0.0)
        one = self.constant(1.0)
        above = [k for k in above if k != one]
        top = max(map(self._level, (*above, *below)), default=LANE)
        for level, group in groupby(sorted(below, key=self._level), key=self._level):
            divisor = self._fold(Op.MUL, group, one)
            above = [*above, self._op(Op.DIV, one, divisor)] if level < top else above
            if level == top:
                return self._op(Op.DIV, self._fold(Op.MUL, above, one), divisor)
        return self._fold(Op.MUL, above, one)

    def _level(self, node: int) -> int:
        return self.nodes[node].level

    def _raised(self, base: sp.Expr, exponent: sp.Expr) -> int:
        halves = 2.0 * float(exponent) if exponent.is_Number else math.nan
        if not halves.is_integer() or abs(halves) > 2 * HIGHEST_PRODUCT:
            return self._op(Op.POW, self(base), self(exponent))
        whole, half = divmod(int(abs(halves)), 2)
        value = self._squared(self(base), whole) if whole else self._op(Op.SQRT, self(base))
        if whole and half:
            value = self._op(Op.MUL, value, self._op(Op.SQRT, self(base)))
        return self._op(Op.DIV, self.constant(1.0), value) if halves < 0 else value

    def _squared(self, base: int, power: int) -> int:
        """`base` to a whole power by repeated squaring."""
        if power == 1:
            return base
        half = self._squared(base, power // 2)
        square = self._op(Op.MUL, half, half)
        return self._op(Op.MUL, square, base) if power % 2 else square


@dataclass(frozen=True)
class Segment:
    """Nodes of a graph that are computed together."""

    roots: tuple[int, ...]  # read by other segments
    nodes: tuple[int, ...]  # sources first
    border: tuple[int, ...]  # nodes of lower levels that they read or that were asked for

    @classmethod
    def of(cls, graph: Graph, wanted: Iterable[int], level: int) -> Segment:
        """Return the nodes of one level that must be computed to know some nodes."""
        ends = tuple(dict.fromkeys(wanted))
        nodes: dict[int, None] = {}
        border: dict[int, None] = {}
        stack = [(k, False) for k in reversed(ends)]
        while stack:
            k, ready = stack.pop()
            node = graph.nodes[k]
            if node.op is None or node.level < level:
                border[k] = None
            elif ready:
                nodes[k] = None
            elif k not in nodes:
                stack += [(k, True), *((s, False) for s in reversed(node.sources))]
        return cls(tuple(k for k in ends if k in nodes), tuple(nodes), tuple(border))

    def instructions(
        self, graph: Graph, fixed: Mapping[int, int], free: int
    ) -> tuple[list[Instruction], int]:
        """Return the instructions, and the row after the last one that they use."""
        fused = self._fused(graph)
        readers = Counter(s for node in fused.values() for s in node.sources)
        rows, idle = dict(fixed), list[int]()
        code: list[Instruction] = []
        for k, node in fused.items():
            if k not in rows:
                rows[k] = idle.pop() if idle else free
                free = max(free, rows[k] + 1)
            a, b, c = (*(rows[s] for s in node.sources), 0, 0, 0)[:3]
            code.append((int(node.op or 0), rows[k], a, b, c, node.table))
            # only now: an instruction must not write what it reads
            for s in node.sources:
                readers[s] -= 1
                if readers[s] == 0 and s not in fixed:
                    idle.append(rows[s])
        return code, free

    def _fused(self, graph: Graph) -> dict[int, Node]:
        """Instructions by node; a product that one sum reads becomes part of it."""
        readers = Counter(s for k in self.nodes for s in graph.nodes[k].sources)
        products = {k for k in self.nodes if graph.nodes[k].op is Op.MUL and readers[k] == 1} - {*self.roots}
        result: dict[int, Node] = {}
        for k in self.nodes:
            node = graph.nodes[k]
            inner = next((s for s in reversed(node.sources) if s in products), None)
            if node.op in (Op.ADD, Op.SUB) and inner is not None:
                del result[inner]
                node = _with_product(node, inner, graph.nodes[inner].sources)
            result[k] = node
        return result


def _with_product(node: Node, inner: int, factors: Sequence[int]) -> Node:
    """A sum or difference with the product `inner` in it."""
    a, b = node.sources
    if node.op is Op.ADD:
        return node._replace(op=Op.MULADD, sources=(*factors, a if inner == b else b))
    if inner == b:
        return node._replace(op=Op.NEGMULADD, sources=(*factors, a))
    return node._replace(op=Op.MULSUB, sources=(*factors, b))
