"""Hypotheses of a user: what is given is checked, then compared, and told in tables."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput, closest
from unmodelled.base.progress import say
from unmodelled.diagnosis.data.options import DEFAULT_OPTIONS
from unmodelled.diagnosis.data.persistence import horizon_of
from unmodelled.diagnosis.data.robot_numbers import with_robot_numbers
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.doubts.numbers import Numbers
from unmodelled.diagnosis.faults.duplicates import different
from unmodelled.diagnosis.faults.look import without_copies
from unmodelled.diagnosis.fitting.checks import check, check_laws, check_windows
from unmodelled.diagnosis.judge.hypotheses import Tried, Wanted, ranked
from unmodelled.diagnosis.judge.known_physics import known_physics
from unmodelled.diagnosis.judge.last_fits import LastFit
from unmodelled.diagnosis.judge.left_out import probabilities
from unmodelled.effects.added import Added
from unmodelled.effects.effect import Effect
from unmodelled.effects.law_files import given_laws
from unmodelled.effects.library import effects
from unmodelled.effects.own_law import Law
from unmodelled.effects.ports_between import with_all_ports_between
from unmodelled.effects.telling import Said, said
from unmodelled.logs.logs import Logs
from unmodelled.logs.preparation import several
from unmodelled.systems.model import System

#: Laws of a hypothesis: own ones, or names of families of the library, also with a place.
Laws: TypeAlias = Sequence[Law | str] | Law | str
#: What the hypothesis is called that the known physics is all.
NOTHING = "no law"


@dataclass(frozen=True, eq=False)
class ComparedHypothesis:
    """A hypothesis with what the logs say about it."""

    name: str
    laws: tuple[str, ...]  # and places in words
    log_scores: Array  # of experiments left out, nats, (experiments,); nan (1,) where it could not be fitted
    evidence: float  # over the known physics, windows of both lengths in the mean, nats
    numbers: tuple[tuple[str, Said], ...]  # of the laws: title of a law, and value, low and high
    warning: str = ""

    @property
    def elpd(self) -> float:
        """Return the expected log predictive density of experiments left out, nats."""
        return float(self.log_scores.sum())

    def difference(self, best: ComparedHypothesis) -> tuple[float, float]:
        """Return by how many nats it predicts worse than the best one, and the standard error."""
        off = best.log_scores - self.log_scores
        return float(off.sum()), float(np.sqrt(len(off) * np.var(off, ddof=1)))


@dataclass(frozen=True, eq=False)
class ComparedHypotheses:
    """Hypotheses, the one that predicts best first."""

    each: tuple[ComparedHypothesis, ...]
    probabilities: tuple[float, ...]  # of `each`; nan where one could not be fitted
    horizon: float  # length of the windows that decide, s
    notes: tuple[str, ...]


def compare_hypotheses(
    system: System,
    logs: Logs,
    hypotheses: Mapping[str, Laws],
    horizon: float | None,
    workers: int | None,
    level: float,
) -> ComparedHypotheses:
    """Compare hypotheses about the gap between a system and experiments (horizon in s).

    Intervals of numbers have the level.
    """
    own = given_laws(_own_laws(hypotheses))
    wanted = _wanted(hypotheses, with_all_ports_between(with_robot_numbers(system)), own)
    logs = several(system, logs)
    horizon = horizon_of(logs, horizon)
    check(system, logs, horizon)
    system, logs, faults = without_copies(system, logs, horizon, DEFAULT_OPTIONS)
    if deciding := [fault.sentence for fault in faults if fault.decides]:
        raise BadInput(f"{logs.source or 'logs'}: correct this before laws are compared: {deciding[0]}")
    check_windows(system, logs, horizon)
    check_laws(own, system, logs, horizon)

    larger = with_all_ports_between(with_robot_numbers(system))
    families = {law.family for laws in wanted.values() for law in laws}
    others = frozenset(effect.family for effect in effects()) - families
    study = Study(larger, different(logs), horizon, (), laws=own, without=others)
    begun = known_physics(study, say)
    threads = os.cpu_count() or 1 if workers is None else workers
    found = ranked(begun.study, begun.fitted, wanted, threads, say)

    rows = [_compared(name, tried, found.overall[name], level) for name, tried in found.tried.items()]
    fitted = sorted((row for row in rows if np.isfinite(row.elpd)), key=lambda row: -row.elpd)
    shares = probabilities(np.stack([row.log_scores for row in fitted])).tolist()
    failed = [row for row in rows if row not in fitted]
    notes = tuple(dict.fromkeys(fault.sentence for fault in faults))
    return ComparedHypotheses(
        (*fitted, *failed), (*shares, *[float("nan")] * len(failed)), found.base.horizon, notes
    )


def _listed(laws: Laws) -> list[Law | str]:
    return [laws] if isinstance(laws, Law | str) else [*laws]


def _own_laws(hypotheses: Mapping[str, Laws]) -> list[Law]:
    """Every own law once."""
    if not isinstance(hypotheses, Mapping) or not hypotheses:
        raise BadInput('hypotheses: must be laws by name, such as {"friction": ["coulomb_friction"]}')
    found = list[Law]()
    for name, laws in hypotheses.items():
        if not isinstance(laws, Law | str | Sequence):
            raise BadInput(f"hypotheses: {name}: must be a list of laws, got {type(laws).__name__}")
        for law in _listed(laws):
            if not isinstance(law, Law | str):
                raise BadInput(f"hypotheses: {name}: must be laws or names, got {type(law).__name__}")
            if isinstance(law, Law) and law not in found:
                found.append(law)
    return found


def _wanted(
    hypotheses: Mapping[str, Laws], system: System, own: Sequence[Law]
) -> dict[str, tuple[Wanted, ...]]:
    """The laws of every hypothesis, each of which can act in the system; the known physics is one, too."""
    known = dict[str, list[Effect]]()
    for effect in (*effects(), *own):
        known.setdefault(effect.family, []).append(effect)
    found = {
        str(name): tuple(_law(f"hypotheses: {name}", law, known, system) for law in _listed(laws))
        for name, laws in hypotheses.items()
    }
    return found if () in found.values() else {**found, NOTHING: ()}


def _law(where: str, given: Law | str, known: Mapping[str, Sequence[Effect]], system: System) -> Wanted:
    family, _, channel = (given.family if isinstance(given, Law) else given).partition("@")
    if family not in known:
        raise BadInput(f"{where}: there is no law {family!r}{closest(family, known)}")
    places = {place.channel for effect in known[family] for place in effect.places(system)}
    if not places:
        raise BadInput(f"{where}: {family}: {system.name} has no place with all that this law needs")
    if channel and channel not in places:
        raise BadInput(f"{where}: {family}: cannot act at {channel!r}{closest(channel, places)}")
    return Wanted(family, channel)


def _compared(name: str, tried: Tried | None, overall: float, level: float) -> ComparedHypothesis:
    if tried is None:
        return ComparedHypothesis(name, (), np.full(1, np.nan), overall, (), "could not be fitted")
    keys = {one.row.atom.key for one in tried.laws}
    last = LastFit(tried.final.fitted, tried.final.base.tau)
    laws = tuple(added for added in last.laws if added.key in keys)
    numbers = tuple(_numbers(last, laws, level))
    return ComparedHypothesis(
        name,
        tuple(added.title for added in laws),
        tried.log_scores,
        overall,
        tuple((title, number) for title, number, _ in numbers),
        "; ".join(_warnings(tried, [number.symbol for _, number, at_bound in numbers if at_bound])),
    )


def _numbers(last: LastFit, laws: Sequence[Added], level: float) -> Iterator[tuple[str, Said, bool]]:
    """Laws in words, their shared numbers with intervals, and whether these ended at a bound."""
    numbers = Numbers(last)
    for added in laws:
        for name in (*added.reported, *added.delays):
            if name in last.values:
                found = numbers.estimate(name, added.units[name], np.nan, level)
                yield added.title, said(added, name, (found.value, *found.interval)), found.at_bound


def _warnings(tried: Tried, at_bound: Sequence[str]) -> Iterator[str]:
    if tried.laws and tried.nats == -np.inf:
        yield "leaves no less than no law"
    if not tried.final.fitted.fit.converged:
        yield "the fit ended before it converged"
    yield from (f"{symbol} ended at its bound" for symbol in at_bound)
