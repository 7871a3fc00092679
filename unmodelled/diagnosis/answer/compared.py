"""What a judgement compared: candidates, evidence by length, chain, and experiments that do not follow."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from unmodelled.diagnosis.data.result import ChainPart, Compared, Evidence
from unmodelled.diagnosis.doubts.numbers import Numbers
from unmodelled.diagnosis.judge.chain import chain_of
from unmodelled.diagnosis.judge.classes import LawClass, stands
from unmodelled.diagnosis.judge.elimination import SIGMAS
from unmodelled.diagnosis.judge.judgement import Judgement
from unmodelled.diagnosis.judge.last_fits import LastFit
from unmodelled.diagnosis.judge.left_out import LeftOutRuns, probabilities
from unmodelled.diagnosis.judge.looks import Look
from unmodelled.diagnosis.judge.refit import Refit
from unmodelled.effects.added import Added

#: Candidates that are listed.
LISTED = 20


def compared(found: Judgement, parts: Sequence[Added]) -> tuple[Compared, ...]:
    """Return the known physics and all refits by predictions of experiments left out, the best first.

    The known physics has its chain, of which some parts are effects where no law is.
    """
    rows: list[tuple[tuple[Added, ...], LeftOutRuns]] = [(tuple(parts), found.look.parent.score)]
    named = rows[0]
    for k, look in enumerate(found.rounds):
        before = tuple(law.speaker.added for law in found.laws[:k])
        rows += [((*before, one.added), one.score) for one in _fitted(look)]
    if found.laws:
        effects = tuple(law.speaker.added for law in found.laws)
        named = next(row for row in rows if row[1] is found.laws[-1].speaker.score)
        named = rows[rows.index(named)] = effects, named[1]
    best = named[1]
    table = [_row(effects, score, best) for effects, score in rows]
    own = next(row for row in table if row.named)
    others = sorted((row for row in table if not row.named), key=lambda row: row.score)
    return tuple(sorted([own, *others[: LISTED - 1]], key=lambda row: row.score))


def _row(effects: tuple[Added, ...], score: LeftOutRuns, named: LeftOutRuns) -> Compared:
    """A candidate: nats per independent sample, and paired differences by experiment."""
    samples, off = named.samples.sum(), named.log_scores - score.log_scores
    error = np.sqrt(len(off) * np.var(off, ddof=1)) if len(off) > 1 else np.nan
    each = (-score.log_scores.sum(), off.sum(), error)
    own, difference, error = (float(value / samples) for value in each)
    return Compared(effects, own, difference, error, score is named)


def _fitted(look: Look) -> list[Refit]:
    """The refits that leave no more than their parent, the best first."""
    return sorted((one for one in look.refits if np.isfinite(one.nats)), key=lambda one: -one.nats)


def probability_of(look: Look, found: LawClass) -> float:
    """Return the probability of a class among all laws that were compared, and none of them."""
    refits = _fitted(look)
    scores = [look.parent.score.log_scores, *(one.log_scores for one in refits)]
    each, laws = probabilities(np.stack(scores))[1:].tolist(), {one.row.name for one in found.members}
    return float(sum(p for p, one in zip(each, refits, strict=True) if one.row.name in laws))


def chance_of_nothing(look: Look) -> float:
    """Return the probability of no law against the best one."""
    best = max(_fitted(look), key=lambda one: one.nats, default=None)
    if best is None:
        return 1.0
    return float(probabilities(np.stack([look.parent.score.log_scores, best.log_scores]))[0])


def left_by_best(look: Look) -> float:
    """Return the share of the squared residual that the best law leaves; 1 where none stands."""
    return 1.0 - max((one.removed for one in _fitted(look) if stands(one)), default=0.0)


def evidence(found: Judgement) -> tuple[Evidence, ...]:
    """Return the evidence of the refitted laws at every length, the best of each first."""
    return tuple(
        Evidence(one.added, look.parent.base.horizon, one.nats, one.removed)
        for look in found.looks
        for one in _fitted(look)
    )


def strangers(found: Judgement) -> tuple[str, ...]:
    """Return the ids of experiments whose error, left out, is larger with the laws than without."""
    if not found.laws:
        return ()
    with_laws, without = found.laws[-1].speaker.score, found.look.parent.score
    worse = with_laws.by_run > without.by_run
    around = found.look.parent.around
    return tuple(around.fitted.recording.logs.ids[i] for i in around.runs[worse])


def chain_parts(found: Judgement, last: LastFit) -> tuple[ChainPart, ...]:
    """Return the parts of the chain that a last fit keeps, and how much experiments deviate if it pays."""
    numbers = Numbers(last)
    shared = [
        ChainPart(added, last.values[name], numbers.error(name), added.units[name], False)
        for added in chain_of(last.leaving)
        for name in added.priors
    ]
    around = found.final.around
    if not around.varies:
        return tuple(shared)
    own, least = around.fitted.fit.own, SIGMAS[0] * np.sqrt(around.tau)
    deviations = [
        (added, name, float(np.std(list(own[name].values()))), least * prior)
        for added in chain_of(around.fitted.hypothesis)
        for name, prior in added.priors.items()
        if name in added.per_experiment
    ]
    vary = [(added, name, size) for added, name, size, smallest in deviations if size > smallest]
    parts = [ChainPart(added, size, float("nan"), added.units[name], True) for added, name, size in vary]
    return (*shared, *parts)
