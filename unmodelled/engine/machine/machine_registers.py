"""From a graph to a list of instructions: their order, fused products and sums, and registers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from unmodelled.engine.machine.machine_graph import Graph, Node
from unmodelled.engine.machine.machine_opcodes import Op

Instruction = tuple[int, int, int, int, int, int]  # opcode, destination, sources a, b and c, table


@dataclass(frozen=True)
class Segment:
    """Nodes of a graph that are computed together.

    Attributes:
        roots: those that others read. nodes: all of them, sources first.
        border: what they read, and what was asked for, of lower levels.
    """

    roots: tuple[int, ...]
    nodes: tuple[int, ...]
    border: tuple[int, ...]

    @classmethod
    def of(cls, graph: Graph, wanted: Iterable[int], level: int) -> Segment:
        """What has to be computed of `level` to know the nodes `wanted`."""
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
        """The instructions, and the row after the last one that they use.

        Args:
            graph: of the nodes. fixed: rows of border and roots. free: first row for what lies between.
        """
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
