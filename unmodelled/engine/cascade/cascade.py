"""A system as a cascade: states that the input alone drives, states of a sample, states of an experiment.

For the clutch of appendix 3.8, pressure and piston follow the current alone, for all samples and motor
speeds; the pressure on the plates and the drag of the oil film are the same for every motor speed and brake.
Parts of expressions are sorted by the quantities that change them, so that each part is computed as rarely as
possible. A compiler cannot do this (loop-invariant code motion) across functions.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from enum import Flag, auto

import sympy as sp

from unmodelled.systems.functions import sanitised
from unmodelled.systems.model import TIME, Event, System, symbol

Named = tuple[tuple[sp.Symbol, sp.Expr], ...]


class Changes(Flag):
    """Dependence of a quantity: on nothing, the operating point, the sample, time."""

    NOTHING = 0
    POINT = auto()  # the operating point
    SAMPLE = auto()  # the sample of the uncertain parameters
    TIME = auto()


#: Where a value is kept, by what it changes with: of an operating point, of a sample, of both, and at every
#: moment for all operating points with the same input.
SCALAR, SAMPLED, RUN, SHARED = (
    Changes.POINT,
    Changes.SAMPLE,
    Changes.POINT | Changes.SAMPLE,
    Changes.SAMPLE | Changes.TIME,
)
PLACES = (SCALAR, SAMPLED, RUN, SHARED)


class Hoisting:
    """Names for the largest parts of expressions that have a place."""

    def __init__(self, changes: Mapping[sp.Symbol, Changes]) -> None:
        #: dependence of every symbol; a symbol that is not in there is computed in the innermost loop
        self.changes = dict(changes)
        #: symbols by place and part, in the order in which they were met
        self.found: dict[Changes, dict[sp.Expr, sp.Symbol]] = {place: {} for place in PLACES}

    def __call__(self, e: sp.Expr, places: tuple[Changes, ...] = PLACES) -> sp.Expr:
        """Return an expression with symbols for its parts that have one of some places."""
        if e.is_number:
            return e
        if self._place(e, places) is not None:
            return self._named(e, places)
        if isinstance(e, (sp.Add, sp.Mul)):
            return self._grouped(e, places)
        return e.func(*(self(a, places) for a in e.args)) if e.args else e

    def without(self, symbols: Collection[sp.Symbol]) -> Hoisting:
        """Return the same, going on with the same names, where some symbols have no place."""
        inner = Hoisting({s: c for s, c in self.changes.items() if s not in symbols})
        inner.found = self.found
        return inner

    def _changes(self, e: sp.Expr) -> Changes | None:
        """What `e` changes with; none if also with what is computed in the innermost loop."""
        together = Changes.NOTHING
        for s in e.free_symbols:
            if s not in self.changes:
                return None
            together |= self.changes[s]
        return together

    def _place(self, e: sp.Expr, places: tuple[Changes, ...]) -> Changes | None:
        changes = self._changes(e)
        return None if changes is None else next((place for place in places if changes in place), None)

    def _named(self, e: sp.Expr, places: tuple[Changes, ...]) -> sp.Expr:
        place, changes = self._place(e, places), self._changes(e)
        if place is None or changes is None or (place == SAMPLED and e.is_Symbol):
            return e  # an uncertain parameter has a row already
        if e.could_extract_minus_sign():
            return -self._named(-e, places)  # one value serves both signs
        names = self.found[place]
        if e not in names:
            names[e] = sp.Dummy("part", real=True)
            self.changes[names[e]] = changes
        return names[e]

    def _grouped(self, e: sp.Expr, places: tuple[Changes, ...]) -> sp.Expr:
        """A sum or product whose terms come together by place, those that change most first."""
        left, parts = list(e.args), []
        for place in reversed(places):
            taken = [a for a in left if (changes := self._changes(a)) is not None and changes in place]
            whole = e.func(*taken)
            if not whole.is_number and self._place(whole, places) == place:
                left = [a for a in left if a not in taken]
                parts.append(self._named(whole, places))
        return e.func(*parts, *(self(a, places) for a in left))


#: What the parts of a place may be computed from.
_LOWER = {SHARED: (SCALAR, SAMPLED), RUN: (SCALAR, SAMPLED), SAMPLED: (SCALAR,), SCALAR: ()}


@dataclass(frozen=True)
class Cascade:
    """Equations that lead to one event, without efforts, divided by their dependence.

    States that do not lead to the event are in no group.
    """

    driven: tuple[int, ...]  # indices of the states that the input alone drives
    #: indices of the states that depend on the uncertain parameters too, but not on the operating point
    shared: tuple[int, ...]
    own: tuple[int, ...]  # indices of the other states
    uncertain: tuple[sp.Symbol, ...]
    clock: tuple[sp.Symbol, ...]  # time, inputs and driven states, as far as used
    #: in terms of the parts of places that change less, those of SHARED also of `clock` and shared states
    parts: Mapping[Changes, Named]
    driven_rates: tuple[sp.Expr, ...]
    shared_rates: tuple[sp.Expr, ...]
    rates: tuple[sp.Expr, ...]  # time derivatives of the own states
    event: sp.Expr  # expression that falls through zero

    @classmethod
    def of(cls, system: System, event: Event, uncertain: Sequence[str]) -> Cascade:
        """Return the cascade that leads to an event."""
        closed, crossing = equations(system, event)
        follows = dependence(system, closed, crossing, uncertain)
        driven = tuple(k for k, changes in follows.items() if changes == Changes.TIME)
        shared = tuple(k for k, changes in follows.items() if changes == SHARED)
        own = tuple(k for k, changes in follows.items() if changes not in SHARED)
        clock = (TIME, *system.u, *(system.x[k] for k in driven))
        constant = dict.fromkeys(system.p, Changes.NOTHING) | _direct(system, uncertain)
        moving = dict.fromkeys(clock, Changes.TIME) | dict.fromkeys((system.x[k] for k in shared), SHARED)
        outer = Hoisting(constant | moving)
        *rates, falling = (outer(e) for e in (*(closed[k] for k in own), crossing))
        # shared values are themselves computed at every moment, from clock and shared states
        inner = outer.without(moving)
        shared_rates = tuple(inner(closed[k], _LOWER[SHARED]) for k in shared)
        parts = {
            place: tuple((name, inner(e, _LOWER[place])) for e, name in list(inner.found[place].items()))
            for place in reversed(PLACES)
        }
        seen = {s for e in (*shared_rates, *(e for _, e in parts[SHARED])) for s in e.free_symbols}
        return cls(
            driven,
            shared,
            own,
            tuple(symbol(name) for name in uncertain),
            tuple(s for s in clock if s in seen),
            parts,
            tuple(closed[k] for k in driven),
            shared_rates,
            tuple(rates),
            falling,
        )


def common_states(system: System, event: Event, uncertain: Sequence[str]) -> tuple[int, ...]:
    """Return the indices of the states that follow the input at every operating point."""
    follows = dependence(system, *equations(system, event), uncertain)
    return tuple(k for k, changes in follows.items() if changes in SHARED)


def equations(system: System, event: Event) -> tuple[tuple[sp.Expr, ...], sp.Expr]:
    """Return time derivatives of the states and the event's expression, every unknown effort zero."""
    none = dict.fromkeys(system.e, sp.S.Zero)
    return tuple(f.xreplace(none) for f in system.closed), sanitised(event.expression)


def dependence(
    system: System, closed: Sequence[sp.Expr], event: sp.Expr, uncertain: Sequence[str]
) -> dict[int, Changes]:
    """Find the dependence of every state that leads to an event, besides that on its own start."""
    index = {s: k for k, s in enumerate(system.x)}
    needed = {index[s] for s in event.free_symbols & set(system.x)}
    before = None
    while before != needed:
        before = set(needed)
        needed |= {index[s] for k in before for s in closed[k].free_symbols & set(system.x)}
    direct = _direct(system, uncertain)
    found = dict.fromkeys(sorted(needed), Changes.TIME)
    last = None
    while last != found:
        last = dict(found)
        for k in found:
            for s in closed[k].free_symbols:
                found[k] |= direct.get(s, Changes.NOTHING) | last.get(index.get(s, -1), Changes.NOTHING)
    return found


def _direct(system: System, uncertain: Sequence[str]) -> dict[sp.Symbol, Changes]:
    """What makes a difference between operating points and between samples."""
    samples = dict.fromkeys((symbol(name) for name in uncertain), Changes.SAMPLE)
    return dict.fromkeys(system.c, Changes.POINT) | samples
