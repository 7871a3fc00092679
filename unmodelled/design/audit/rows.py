"""Every number of a system: determined, tied to others, bent by a missing law, or known; values of sets."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

from scipy.special import chdtri

from unmodelled.design.audit.fits import AuditFits
from unmodelled.design.audit.number_sets import NumberSet
from unmodelled.design.audit.ties import ties
from unmodelled.diagnosis.data.remark import Remark
from unmodelled.diagnosis.data.result import Estimate
from unmodelled.diagnosis.doubts.numbers import Numbers
from unmodelled.diagnosis.doubts.undetermined import UNDETERMINED_CHANGE
from unmodelled.effects.added import Added
from unmodelled.systems.model import Parameter

#: What logs say about a number.
Kind = Literal["determined", "combined", "undetermined", "absorbs", "known", "wrong"]
#: What logs say about a value: it agrees, holds in a model without a law only, is contradicted, or is open.
Mark = Literal["agrees", "absorbs", "contradicted", "open"]

#: A law that no formula names, which a network in every port stands for.
UNNAMED = "a law that is not named"


@dataclass(frozen=True)
class Move:
    """A number that a law moves when it is added."""

    law: str  # in words
    family: str  # of the law, "" where nothing names it
    channel: str  # where it acts, "" where that is not known
    value: float  # without the law
    interval: tuple[float, float]  # of the same


@dataclass(frozen=True)
class AuditedNumber:
    """A number of the system, in its unit."""

    name: str
    unit: str
    known: float  # in the system file
    kind: Kind
    estimate: Estimate | None  # with all laws; None where it was not fitted
    forms: Mapping[str, float] = field(default_factory=dict)  # with other forms of a law, beyond its interval
    moves: tuple[Move, ...] = ()  # by laws without which it is another number
    tied: tuple[str, ...] = ()  # numbers together with which it is determined
    sentence: str = ""  # how it is tied, or why it is not determined
    values: Mapping[str, float] = field(default_factory=dict)  # by set
    marks: Mapping[str, Mark] = field(default_factory=dict)  # by set


@dataclass(frozen=True, eq=False)
class NumberAudit:
    """The numbers of fits; values that differ by at most the share `close` are the same."""

    fits: AuditFits
    close: float

    @property
    def level(self) -> float:
        """Return the level of the intervals."""
        return self.fits.judged.every.options.level

    def rows(self, sets: Sequence[NumberSet]) -> tuple[AuditedNumber, ...]:
        """Return every number of the system, with what the logs say about its value in every set."""
        loose = ties(self.fits)
        wrong = {law.place.name: law for law in self.fits.judged.laws if law.is_other_value}
        every = [p for p in self.fits.system.parameters if not p.per_experiment]
        rows = [self._row(p, wrong.get(p.name), loose.get(p.name)) for p in every]
        return tuple(self._marked(row, sets) for row in rows)

    def _row(self, p: Parameter, wrong: Added | None, tie: Remark | None) -> AuditedNumber:
        if wrong is not None:
            return self._wrong(p, wrong)
        row = AuditedNumber(p.name, p.unit, p.value, "known", None)
        if not p.identify:
            return row
        found = self.fits.numbers.estimate(p.name, p.unit, p.value, self.level)
        row = replace(row, kind="determined", estimate=found)
        if tie is not None:
            tied = tuple(name for name in tie.numbers if name != p.name)
            return replace(row, kind="combined", tied=tied, sentence=tie.sentence)
        if found.at_bound or not found.determined:
            return replace(row, kind="undetermined", sentence=_why_not(p, found))
        moves = tuple(self._moves(p, found))
        forms = {law: value for law, value in self.fits.forms(p.name) if not self._same(value, found)}
        found = replace(found, interval=self._interval(p, found, forms.values()))
        low, high = found.interval
        if 0.5 * (high - low) >= UNDETERMINED_CHANGE * max(abs(found.value), abs(p.value)):
            return replace(row, kind="undetermined", estimate=found, sentence=_why_not(p, found))
        return replace(
            row, kind="absorbs" if moves else "determined", estimate=found, forms=forms, moves=moves
        )

    def _interval(self, p: Parameter, found: Estimate, forms: Iterable[float]) -> tuple[float, float]:
        """The interval with other forms of a law, and whether experiments deviate or not.

        A mean deviation of the experiments stands in for a number, and the number for it.
        """
        every = (Numbers(fit).estimate(p.name, p.unit, p.value, self.level) for fit in self.fits.variants)
        ends = [*found.interval, *forms, *(end for one in every for end in one.interval)]
        return min(ends), max(ends)

    def _wrong(self, p: Parameter, law: Added) -> AuditedNumber:
        """A number that the file calls known, and that has another value."""
        (error,) = law.amplitudes
        found = self.fits.numbers.estimate(error, p.unit, p.value, self.level)
        low, high = (p.value + end for end in found.interval)
        shifted = replace(found, value=p.value + found.value, interval=(low, high))
        return AuditedNumber(p.name, p.unit, p.value, "wrong", shifted)

    def _moves(self, p: Parameter, found: Estimate) -> Iterator[Move]:
        """Laws without which a number is another one: beyond its interval, and by more than is the same."""
        for law, fit in self.fits.without:
            other = Numbers(fit.last).estimate(p.name, p.unit, p.value, self.level)
            if not self._same(other.value, found):
                yield Move(law.title, law.family, law.place.channel, other.value, other.interval)
        if p.name in self.fits.network and not self._same(self.fits.network[p.name], found):
            # what a network makes of a number is no estimate of it: the number without the law is the fit's
            yield Move(UNNAMED, "", "", found.value, found.interval)

    def _same(self, value: float, found: Estimate | Move) -> bool:
        low, high = found.interval
        return low <= value <= high or abs(value - found.value) <= self.close * abs(found.value)

    def _marked(self, row: AuditedNumber, sets: Sequence[NumberSet]) -> AuditedNumber:
        having = [one for one in sets if row.name in one.values]
        marks = {one.name: self._mark(row, one) for one in having}
        return replace(row, values={one.name: one.values[row.name] for one in having}, marks=marks)

    def _mark(self, row: AuditedNumber, one: NumberSet) -> Mark:
        value, found = one.values[row.name], row.estimate
        if found is None:  # held at the value of the file
            return "agrees" if abs(value - row.known) <= self.close * abs(row.known) else "open"
        if row.kind == "undetermined":
            return "open"
        if row.kind == "combined":
            return "contradicted" if self._apart(row, one) else "open"
        if self._same(value, found):
            unnamed = any(not move.family for move in row.moves)
            return "open" if unnamed or row.forms else "agrees"
        return "absorbs" if any(self._same(value, move) for move in row.moves) else "contradicted"

    def _apart(self, row: AuditedNumber, one: NumberSet) -> bool:
        """Whether the logs contradict the values of numbers that only show together."""
        group = {row.name, *row.tied} & set(self.fits.opened)
        values = {name: value for name, value in one.values.items() if name in group}
        return self.fits.numbers.distance(values, self.close) > float(chdtri(len(values), 1.0 - self.level))


def _why_not(p: Parameter, found: Estimate) -> str:
    if found.at_bound:
        return f"{p.name} ends at one of its bounds: widen them, or measure it separately"
    return f"these logs do not determine {p.name}: measure it separately, or log motions in which it matters"
