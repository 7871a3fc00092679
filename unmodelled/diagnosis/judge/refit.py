"""Laws refitted inside the simulation, and their evidence over the fit beside which they stand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis
from unmodelled.diagnosis.fitting.unknowns import Start
from unmodelled.diagnosis.judge.base import Base
from unmodelled.diagnosis.judge.left_out import LeftOutRuns
from unmodelled.diagnosis.judge.linear import Linearised, Weights
from unmodelled.diagnosis.judge.residual import Residual
from unmodelled.diagnosis.judge.scan import Row, best_by_name
from unmodelled.diagnosis.search.proposal import Proposal
from unmodelled.effects.added import Added

#: Laws that are refitted at a length.
REFITS = 6
#: Faults of a fit that leaves the range of a law: such a law is no answer.
FAULTS = ArithmeticError, ValueError, KeyError, np.linalg.LinAlgError


@dataclass(frozen=True, eq=False)
class Parent:
    """A fit beside which laws are judged."""

    base: Base
    fitted: FittedHypothesis
    residual: Residual
    around: Linearised
    weights: Weights  # of the base: nats of all rounds compare

    @cached_property
    def score(self) -> LeftOutRuns:
        """Return the experiments left out, without a law more."""
        return LeftOutRuns.of(self.around)

    @classmethod
    def of(cls, base: Base) -> Parent:
        """Return the base itself."""
        around = Linearised.of(base.fitted, base.tau)
        return cls(base, base.fitted, base.residual, around, around.weights)

    def beside(self, law: Refit) -> Parent:
        """Return the fit with one law more."""
        around = Linearised.of(law.fitted, self.base.tau, self.weights)
        return Parent(self.base, law.fitted, law.residual, around, self.weights)


@dataclass(frozen=True, eq=False)
class Refit:
    """A law refitted inside the simulation with everything open."""

    row: Row
    fitted: FittedHypothesis
    residual: Residual
    score: LeftOutRuns
    nats: float  # evidence over its parent; -inf if it leaves more than its parent
    removed: float  # share of the squared residual of its parent, of the output where it is largest

    @property
    def added(self) -> Added:
        """Return the law in the system."""
        return self.fitted.hypothesis.effects[-1]

    @property
    def numbers(self) -> dict[str, tuple[float, float]]:
        """Return the fitted numbers of the law and their standard deviations, SI."""
        fit, added = self.fitted.fit, self.added
        names = [n for n in (*added.amplitudes, *added.shapes, *added.delays) if n in fit.values]
        return {n: (float(fit.values[n]), float(np.sqrt(fit.variance(n)))) for n in names}


@dataclass
class Carried:
    """Fits of shorter windows by law, from which those of longer ones start."""

    starts: dict[tuple[str, str], Start] = field(default_factory=dict)
    nats: dict[tuple[str, str], float] = field(default_factory=dict)

    def among(self, rows: Sequence[Row], most: int = 3) -> list[Row]:
        """Return the rows of the best laws of the last length, each with its best shape here."""
        best = sorted(self.nats, key=lambda key: -self.nats[key])[:most]
        own = [[row for row in rows if row.key == key] for key in best]
        return [max(each, key=lambda row: row.nats) for each in own if each]


def refits(parent: Parent, rows: Sequence[Row], carried: Carried | None = None) -> list[Refit]:
    """Refit the best laws of a scan and those of shorter windows; `carried` learns the fits."""
    wanted = best_by_name(rows)[:REFITS]
    known = {row.key for row in wanted}
    wanted += [row for row in carried.among(rows) if row.key not in known] if carried else []
    found = []
    for row in wanted:
        try:
            one = refit(parent, row, carried.starts.get(row.key) if carried else None)
        except FAULTS:
            continue
        found += [] if one is None else [one]
    if carried is not None:
        carried.starts |= {one.row.key: one.fitted.fit.every for one in found}
        carried.nats = {one.row.key: one.nats for one in found}
    return found


def refit(parent: Parent, row: Row, carried: Start | None = None) -> Refit | None:
    """Fit a law from its linear step and from its fit to shorter windows; None where it cannot be added."""
    base, proposal = parent.base, Proposal(parent.fitted, (row.atom,), (row.amount,))
    if not proposal.is_possible:
        return None
    linear = dict(proposal.starts[0])
    starts: list[Start] = [linear] if carried is None else [linear, {**linear, **carried}]
    fitted = base.fit(proposal.hypothesis, starts)
    residual = Residual.of(fitted, base.residual.cap)
    around = Linearised.of(fitted, base.tau, parent.weights)
    price = parent.weights.price(row.atom.numbers) + float(np.log(row.shapes))
    nats = around.evidence - parent.around.evidence - price
    left: Array = residual.square / parent.residual.square
    failed = not np.isfinite(nats) or float(left.mean()) > 1.0
    own = -np.inf if failed else nats
    return Refit(row, fitted, residual, LeftOutRuns.of(around), own, float(1.0 - left.min()))
