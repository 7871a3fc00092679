"""Fits of an audit: with all laws that are missing, and without each of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from unmodelled.design.audit.number_sets import NumberSet
from unmodelled.diagnosis.answer.judged import Judged, judged_models
from unmodelled.diagnosis.answer.models import Leaving
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.doubts.numbers import Numbers
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis
from unmodelled.diagnosis.judge.chain import Key, chain_of
from unmodelled.diagnosis.judge.last_fits import LastFit, last_fits
from unmodelled.diagnosis.judge.network import fit_network
from unmodelled.effects.added import Added
from unmodelled.systems.model import Parameter, System

#: Widest range of a number that a set doubts and for which the file gives no bounds, in its size.
LEAST, MOST = 1e-4, 1e4


@dataclass(frozen=True, eq=False)
class AuditFits:
    """Fits of a system whose audited numbers are open."""

    given: System  # as the file marks its numbers
    judged: Judged
    without: tuple[tuple[Added, Leaving], ...]  # every law, and the fit with all others
    network: Mapping[str, float]  # numbers beside a network in every port; {} where laws name all

    @property
    def system(self) -> System:
        """Return the system with open numbers."""
        return self.judged.study.system

    @property
    def opened(self) -> tuple[str, ...]:
        """Return the names of the open numbers."""
        return self.system.uncertain

    @property
    def whole(self) -> Leaving:
        """Return the fit with all laws."""
        return self.judged.models.augmented

    @property
    def plain(self) -> Leaving:
        """Return the fit without any law."""
        return self.fitted(self.system, laws=False) if self.judged.laws else self.whole

    @cached_property
    def numbers(self) -> Numbers:
        """Return the numbers of the fit with all laws."""
        return Numbers(self.whole.last)

    @cached_property
    def variants(self) -> tuple[LastFit, ...]:
        """Return the fits with all laws: numbers that deviate between experiments, if any do, and none."""
        last = self.whole.last
        if not any(added.per_experiment for added in self.judged.found.final.fitted.hypothesis.effects):
            return (last,)
        return tuple(_fits(self.judged, self.system, [law.key for law in self.judged.laws]))

    @property
    def steady(self) -> FittedHypothesis:
        """Return the fit with all laws in which no number deviates between experiments.

        It shows which numbers only show together: where each deviates, the logs tell their mean less well.
        """
        return self.variants[-1].fitted

    def forms(self, name: str) -> Iterator[tuple[str, float]]:
        """Yield a number with every form of the last law that the logs cannot tell from the named one."""
        found = self.judged.found
        for one in found.laws[-1].members[1:] if found.laws else ():
            values = one.fitted.fit.values
            if name in values:
                yield one.added.title, float(values[name])

    def fitted(self, system: System, *, laws: bool) -> Leaving:
        """Return a fit of a system with all laws or none, and with the parts of the chain that pay."""
        kept = [law.key for law in self.judged.laws] if laws else []
        return _fitted(self.judged, system, kept)


def audit_fits(
    given: Study, sets: Sequence[NumberSet], chosen: Sequence[str], workers: int, say: Callable[[str], None]
) -> AuditFits:
    """Name the laws that are missing where the numbers of a system are open, and fit without each of them.

    Open numbers are those `chosen`, or without any those that the file marks and those that a set doubts.
    """
    opened = opened_system(given.system, sets, chosen)
    judged = judged_models(replace(given, system=opened), workers, say)
    say("fit the numbers without each law")
    laws = judged.laws
    fits = [_fitted(judged, judged.study.system, [o.key for o in laws if o is not law]) for law in laws]
    network = dict[str, float]()
    if not judged.names_all:
        say("fit the numbers beside a network in every port")
        last = judged.models.augmented.last
        network = dict(fit_network(last.fitted, given.seed, opened.port_names).fit.values)
    return AuditFits(given.system, judged, tuple(zip(laws, fits, strict=True)), network)


def opened_system(system: System, sets: Sequence[NumberSet], chosen: Sequence[str]) -> System:
    """Return the system with its audited numbers open, and all others known."""
    doubted = {
        p.name
        for p in system.parameters
        for one in sets
        if one.values.get(p.name, p.value) != p.value and not p.per_experiment
    }
    names = set(chosen) or doubted | set(system.uncertain)
    values = {p.name: [one.values[p.name] for one in sets if p.name in one.values] for p in system.parameters}
    parameters = (
        _opened(p, values[p.name])
        if p.name in names
        else replace(p, identify=p.identify and p.per_experiment)
        for p in system.parameters
    )
    return replace(system, parameters=tuple(parameters))


def _opened(p: Parameter, values: Sequence[float]) -> Parameter:
    """A number that is fitted, within bounds that hold all values that somebody believes in."""
    if p.bounds is None and p.value == 0.0:
        size = MOST * max(map(abs, values), default=0.0)
        return replace(p, identify=True, bounds=(-size, size) if size else None)
    ends = p.bounds or (LEAST * p.value, MOST * p.value)
    return replace(p, identify=True, bounds=(min(*ends, *values), max(*ends, *values)))


def of_set(system: System, given: System, one: NumberSet) -> System:
    """Return a system with open numbers that has those of a set; other marked ones are fitted."""
    marked = set(given.uncertain)
    parameters = (
        replace(p, value=one.values[p.name], identify=False, bounds=None)
        if p.name in one.values
        else replace(p, identify=p.per_experiment or p.name in marked)
        for p in system.parameters
    )
    return replace(system, parameters=tuple(parameters))


def _fitted(judged: Judged, system: System, kept: Sequence[Key]) -> Leaving:
    """A fit of a system with some of the laws and the parts of the chain that pay."""
    return Leaving.of("", _fits(judged, system, kept), judged.every)


def _fits(judged: Judged, system: System, kept: Sequence[Key]) -> Iterator[LastFit]:
    """Fits in which numbers deviate between experiments, if any do, and in which none does."""
    part, leaving = judged.models.part, judged.models.augmented.last.leaving
    chain = [one.key for one in chain_of(leaving)]
    named = [] if part is None else [part.added.key]
    return last_fits(judged.found.final, system, kept, chain, named)
