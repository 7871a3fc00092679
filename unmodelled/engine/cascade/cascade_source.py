"""The generated part of the event times of one cascade: Runge-Kutta steps on blocks of samples side by side.

As in `source.py` a block is one flat array of rows at addresses that are literals in the code.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate

import sympy as sp

from unmodelled.engine.cascade.cascade import RUN, SAMPLED, SCALAR, SHARED, Cascade, Changes
from unmodelled.engine.cascade.cascade_loops import LANES, Places
from unmodelled.engine.compiled.printer import assignments
from unmodelled.engine.compiled.source import tables
from unmodelled.systems.model import TIME, System

HEAD = """import math

import numpy as np

from unmodelled.engine.cascade.cascade_loops import *
from unmodelled.engine.compiled.scalars import *
"""
Names = Mapping[sp.Symbol, str]
#: Of a step h, as `end` and `middle` use them.
FRACTIONS = ("half = h/2.0", "sixth = h/6.0", "part = h/24.0")


@dataclass(frozen=True)
class CascadeSource:
    """Writer of the functions of `cascade_loops.Generated` for one cascade."""

    system: System
    cascade: Cascade

    @cached_property
    def rows(self) -> dict[str, int]:
        """First row of every part of a block; under "end" their number."""
        part, n = self.cascade.parts, len(self.cascade.own)
        sizes = {"sample": len(self.cascade.uncertain), "sampled": len(part[SAMPLED])}
        sizes |= {"state": len(self.cascade.shared), "own": n, "before": n, "event": 1, "event_before": 1}
        sizes |= {"run": len(part[RUN]), "scalars": -(-len(part[SCALAR]) // LANES), "end": 0}
        return dict(zip(sizes, accumulate([0, *sizes.values()]), strict=False))

    @property
    def values(self) -> int:
        """Number of shared values at one moment."""
        return len(self.cascade.parts[SHARED])

    def places(self) -> Places:
        """Return the places where the loops find the parts of a block."""
        rows, cascade = self.rows, self.cascade
        return Places(
            sample=rows["sample"],
            samples=len(cascade.uncertain),
            state=rows["state"],
            states=len(cascade.shared),
            own=rows["own"],
            own_rows=rows["end"] - rows["own"],
            own_states=len(cascade.own),
            event=rows["event"],
            event_before=rows["event_before"],
            rows=rows["end"],
            values=self.values,
            clock=len(cascade.clock),
        )

    def text(self) -> str:
        """Return the text of the module."""
        parts = [self._drive(), self._operating(), self._begin(), self._share(), self._prepare()]
        parts += [self._advance(), self._middle()]
        return "\n\n".join([HEAD, *tables(self.system, "\n".join(parts)), *parts])

    @cached_property
    def names(self) -> Names:
        """Variables of the code: numbered, so that nothing a user wrote stands in it."""
        system, cascade = self.system, self.cascade
        letters = {SCALAR: "o", SAMPLED: "q", RUN: "r", SHARED: "v"}
        return _numbered(
            p=system.p,
            c=system.c,
            s=cascade.uncertain,  # those of the sample, not of the system
            d=cascade.clock,
            m=[system.x[k] for k in cascade.shared],
            x=[system.x[k] for k in cascade.own],
            **{letters[place]: [name for name, _ in found] for place, found in cascade.parts.items()},
        )

    def _computed(self, targets: Mapping[str, sp.Expr]) -> list[str]:
        return _assigned(targets, self.names)

    def _parts(self, place: Changes, targets: Sequence[str]) -> list[str]:
        """The parts of a place, computed into cells."""
        return self._computed(dict(zip(targets, (e for _, e in self.cascade.parts[place]), strict=True)))

    def _scalars(self) -> list[str]:
        first = self.rows["scalars"] * LANES
        return [f"o{k} = w[{first + k}]" for k in range(len(self.cascade.parts[SCALAR]))]

    def _uncertain(self) -> list[str]:
        return load("s", self.rows["sample"], len(self.cascade.uncertain))

    def _sample(self) -> list[str]:
        return [*self._uncertain(), *load("q", self.rows["sampled"], len(self.cascade.parts[SAMPLED]))]

    def _run(self) -> list[str]:
        return [*self._sample(), *load("r", self.rows["run"], len(self.cascade.parts[RUN]))]

    def _moments(self) -> list[list[str]]:
        """The clock at the start, middle and end of the step for which it begins at d[at]."""
        n = len(self.cascade.clock)
        return [[f"d{k} = d[at + {slot * n + k}]" for k in range(n)] for slot in range(3)]

    def _values(self) -> list[list[str]]:
        """Shared values at the start, middle and end of the step for which they are `u`."""
        return [load("v", slot * self.values, self.values, "u") for slot in range(3)]

    def _share_at(self, slot: int) -> list[str]:
        """Assignments of the shared values."""
        return self._parts(SHARED, cells(slot * self.values, self.values, "u"))

    def _step_values(self) -> str:
        # a slice once a step: an index into it cannot be negative, and so the loop over the lanes vectorises
        return f"u = v[k*{2 * self.values * LANES}:]"

    def _rates(self, rates: Sequence[sp.Expr]) -> Callable[[int], list[str]]:
        return lambda stage: self._computed({f"k{stage}_{k}": e for k, e in enumerate(rates)})

    def _drive(self) -> str:
        """Driven states, step by step, of one input alone."""
        system, n = self.system, len(self.cascade.driven)
        forcing = (TIME, *system.u)
        names = _numbered(p=system.p, e=forcing, x=[system.x[k] for k in self.cascade.driven])
        size = len(forcing)
        slots = [[f"e{j} = d[{2 * size}*k + {slot * size + j}]" for j in range(size)] for slot in range(3)]

        def rates(stage: int) -> list[str]:
            return _assigned({f"k{stage}_{j}": e for j, e in enumerate(self.cascade.driven_rates)}, names)

        step = stages("x", [f"x[{n}*k + {j}]" for j in range(n)], rates, slots)
        step += [f"x[{n}*k + {n + j}] = {end(j)}" for j in range(n)]
        known = [f"p{k} = p[{k}]" for k in range(len(system.p))]
        return function(
            "DRIVE",
            "drive(x, p, d, steps, h)",
            [*known, *FRACTIONS, "for k in range(steps):", *indented(step)],
        )

    def _operating(self) -> str:
        first = self.rows["scalars"] * LANES
        known = [f"p{k} = p[{k}]" for k in range(len(self.system.p))]
        known += [f"c{k} = c[{k}]" for k in range(len(self.system.c))]
        targets = [f"w[{first + k}]" for k in range(len(self.cascade.parts[SCALAR]))]
        return function("OPERATING", "operating(w, p, c)", [*known, *self._parts(SCALAR, targets)])

    def _begin(self) -> str:
        lane = [
            *self._uncertain(),
            *self._parts(SAMPLED, cells(self.rows["sampled"], len(self.cascade.parts[SAMPLED]))),
            *self._sample(),
            *load("m", self.rows["state"], len(self.cascade.shared)),
            *self._moments()[0],
            *self._share_at(0),
        ]
        return function("BEGIN", "begin(w, v, d)", ["u, at = v, 0", *self._scalars(), *over_lanes(lane)])

    def _share(self) -> str:
        moments, state = self._moments(), cells(self.rows["state"], len(self.cascade.shared))
        lane = [
            *self._sample(),
            *stages("m", state, self._rates(self.cascade.shared_rates), moments),
            *(f"m{k} = {middle(k)}" for k in range(len(state))),
            *moments[1],
            *self._share_at(1),
            *(f"m{k} = {cell} = {end(k)}" for k, cell in enumerate(state)),
            *moments[2],
            *self._share_at(2),
        ]
        head = [self._step_values(), *self._scalars(), *FRACTIONS]
        return function("SHARE", "share(w, v, k, d, at, h)", [*head, *over_lanes(lane)])

    def _prepare(self) -> str:
        lane = [
            *self._sample(),
            *self._parts(RUN, cells(self.rows["run"], len(self.cascade.parts[RUN]))),
            *self._run(),
            *load("x", self.rows["own"], len(self.cascade.own)),
            *self._values()[0],
            *self._computed(dict(zip(cells(self.rows["event"], 1), [self.cascade.event], strict=True))),
        ]
        return function("PREPARE", "prepare(w, v)", ["u = v", *self._scalars(), *over_lanes(lane)])

    def _step(self, row: str) -> list[str]:
        """The stages of an operating point's own states, which start from `row`."""
        start = cells(self.rows[row], len(self.cascade.own))
        return [*self._run(), *stages("x", start, self._rates(self.cascade.rates), self._values())]

    def _advance(self) -> str:
        n, rows = len(self.cascade.own), self.rows
        (event,), (event_before,) = cells(rows["event"], 1), cells(rows["event_before"], 1)
        lane = [
            *self._step("own"),
            *(f"{cell} = y{k}" for k, cell in enumerate(cells(rows["before"], n))),
            *(f"x{k} = {cell} = {end(k)}" for k, cell in enumerate(cells(rows["own"], n))),
            *self._computed({"after": self.cascade.event}),
            f"before = {event_before} = {event}",
            f"{event} = after",
            "changes += (before > 0.0) != (after > 0.0)",
        ]
        step = [
            self._step_values(),
            "changes = 0",
            *over_lanes(lane),
            "k += 1",
            "if changes > 0:",
            "    break",
        ]
        head = [*self._scalars(), *FRACTIONS, "while k < stop:"]
        return function("ADVANCE", "advance(w, v, k, stop, h)", [*head, *indented(step), "return k"])

    def _middle(self) -> str:
        lines = [
            self._step_values(),
            *self._scalars(),
            *FRACTIONS,
            *self._step("before"),
            *(f"x{k} = {middle(k)}" for k in range(len(self.cascade.own))),
            *self._values()[1],
            *self._computed({"value": self.cascade.event}),
            "return value",
        ]
        return function("MIDDLE", "middle(w, v, i, k, h)", lines)


def _numbered(**groups: Sequence[sp.Symbol]) -> Names:
    return {s: f"{letter}{k}" for letter, members in groups.items() for k, s in enumerate(members)}


def _assigned(targets: Mapping[str, sp.Expr], names: Names) -> list[str]:
    """Assignments of expressions to variables or cells."""
    before, lane, results = assignments(list(targets.values()), names, set())
    return [*before, *lane, *(f"{to} = {text}" for to, text in zip(targets, results, strict=True))]


def cells(first: int, n: int, array: str = "w") -> list[str]:
    """Return the code of the numbers of some rows in lane i."""
    return [f"{array}[{(first + k) * LANES} + i]" for k in range(n)]


def load(letter: str, first: int, n: int, array: str = "w") -> list[str]:
    """Return assignments of rows to variables `letter`0, `letter`1, ..."""
    return [f"{letter}{k} = {cell}" for k, cell in enumerate(cells(first, n, array))]


def over_lanes(lines: Iterable[str]) -> list[str]:
    """Return a loop over the lanes."""
    return ["for i in range(LANES):", *indented(lines)]


def indented(lines: Iterable[str]) -> list[str]:
    """Return the body of a loop or function."""
    return [f"    {line}" for line in (*lines, "pass")]


def function(signature: str, head: str, lines: Iterable[str]) -> str:
    """Return a compiled function."""
    return "\n".join([f"@jit({signature})", f"def {head}:", *indented(lines)]) + "\n"


def stages(
    letter: str, states: Sequence[str], rates: Callable[[int], list[str]], slots: Sequence[list[str]]
) -> list[str]:
    """Return the stages of a step of Runge and Kutta."""
    n = range(len(states))
    lines = [f"{letter}{k} = y{k} = {cell}" for k, cell in enumerate(states)]
    for stage, slot in enumerate((0, 1, 1, 2)):
        lines += [*slots[slot], *rates(stage)]
        if stage < 3:
            factor = "h" if stage == 2 else "half"
            lines += [f"{letter}{k} = y{k} + {factor}*k{stage}_{k}" for k in n]
    return lines


def end(k: int) -> str:
    """Return the code of a state at the end of a step."""
    return f"y{k} + sixth*(k0_{k} + 2.0*(k1_{k} + k2_{k}) + k3_{k})"


def middle(k: int) -> str:
    """Return the code of a state in the middle of a step, to third order, from the same stages."""
    return f"y{k} + part*(5.0*k0_{k} + 4.0*(k1_{k} + k2_{k}) - k3_{k})"
