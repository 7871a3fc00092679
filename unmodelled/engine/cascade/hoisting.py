"""Parts of expressions sorted by what they change with, so that each is computed as seldom as it can be.

This is loop-invariant code motion on symbolic equations: what a compiler cannot do across functions.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from enum import Flag, auto

import sympy as sp


class Changes(Flag):
    """What a quantity changes with."""

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
    """Gives names to the largest parts of expressions that have a place.

    Attributes:
        changes: what every symbol changes with; a symbol that is not in there is computed in the innermost
            loop.
        found: place -> part -> its symbol, in the order in which they were met.
    """

    def __init__(self, changes: Mapping[sp.Symbol, Changes]) -> None:
        self.changes = dict(changes)
        self.found: dict[Changes, dict[sp.Expr, sp.Symbol]] = {place: {} for place in PLACES}

    def __call__(self, e: sp.Expr, places: tuple[Changes, ...] = PLACES) -> sp.Expr:
        """`e` with symbols for its parts that have one of `places`."""
        if e.is_number:
            return e
        if self._place(e, places) is not None:
            return self._named(e, places)
        if isinstance(e, (sp.Add, sp.Mul)):
            return self._grouped(e, places)
        return e.func(*(self(a, places) for a in e.args)) if e.args else e

    def without(self, symbols: Collection[sp.Symbol]) -> Hoisting:
        """The same, and going on with the same names, where `symbols` have no place."""
        inner = Hoisting({s: c for s, c in self.changes.items() if s not in symbols})
        inner.found = self.found
        return inner

    def _changes(self, e: sp.Expr) -> Changes | None:
        """What `e` changes with; none if also with what is computed in the innermost loop."""
        together = Changes.NOTHING
        for symbol in e.free_symbols:
            if symbol not in self.changes:
                return None
            together |= self.changes[symbol]
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
