"""Looks: the evidence of laws over windows of every length, and the length that decides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from unmodelled.diagnosis.judge.base import Base
from unmodelled.diagnosis.judge.classes import NEARLY_ALL, LawClass, best_class, stands
from unmodelled.diagnosis.judge.refit import Carried, Parent, Refit, completed, refits
from unmodelled.diagnosis.judge.scan import Row, scan


@dataclass(frozen=True, eq=False)
class Look:
    """Evidence of laws at one length of the windows."""

    parent: Parent
    rows: tuple[Row, ...]  # every law by its linear step
    refits: tuple[Refit, ...]

    @property
    def matters(self) -> bool:
        """Return whether the gap of the base matters at this length."""
        return self.parent.base.matters(self.parent.residual)

    def alone(self, law: LawClass) -> Refit | None:
        """Return a law that was found beside another one as it was refitted here, None where it was not."""
        return next((one for one in self.refits if one.row.key == law.speaker.row.key), None)

    def first(self, matters: bool) -> LawClass | None:
        """Return the class that is named; where no gap `matters`, only if it leaves nearly nothing.

        That is if a law removes nearly all of the gap, or leaves noise where the base does not.
        """
        found = best_class(self.refits)
        if found is None or matters or max(one.removed for one in found.members) >= NEARLY_ALL:
            return found
        return found if found.speaker.residual.white and not self.parent.residual.white else None


def look_at(base: Base, carried: Carried, workers: int) -> Look:
    """Return the evidence of laws around a base, or around the better one that a law leads to."""
    while True:
        parent = Parent.of(base)
        rows = scan(parent.around)
        found = refits(parent, rows, workers, carried)
        best = max(found, key=lambda one: one.nats, default=None)
        better = base.improved(best.fitted) if best is not None and stands(best) else None
        if better is None:
            return Look(parent, tuple(rows), tuple(found))
        base = better


def together(looks: Sequence[Look], workers: int) -> list[Look]:
    """Return looks with the best laws of each fitted in all of them, and their evidence overall.

    A law that cannot be fitted at a length is of size zero there. One that is among the best of no length
    has no overall evidence.
    """
    every = [
        completed(
            look.parent,
            look.rows,
            look.refits,
            [r for o in looks if o is not look for r in o.refits],
            workers,
        )
        for look in looks
    ]
    by_key = [{one.row.key: one.or_nothing for one in each} for each in every]
    shared = set.intersection(*(set(each) for each in by_key))
    overall = {key: float(np.mean([each[key] for each in by_key])) for key in shared}
    return [
        replace(look, refits=tuple(replace(one, overall=overall.get(one.row.key, -np.inf)) for one in each))
        for look, each in zip(looks, every, strict=True)
    ]


def deciding(looks: Sequence[Look]) -> Look:
    """Return the longest look at which the best law of those that stand anywhere stands."""
    standing = [
        (one.overall, k, one.row.key) for k, look in enumerate(looks) for one in look.refits if stands(one)
    ]
    best = max(standing, default=None)
    if best is None:
        return looks[-1]
    return looks[max(k for _, k, key in standing if key == best[2])]
