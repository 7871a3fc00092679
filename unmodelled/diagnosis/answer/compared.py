"""What a judgement compared: candidates, evidence by length, chain, and experiments that do not follow."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.diagnosis.data.result import ChainPart, Compared, Evidence
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.doubts.numbers import Numbers
from unmodelled.diagnosis.judge.chain import chain_of
from unmodelled.diagnosis.judge.classes import LawClass, stands
from unmodelled.diagnosis.judge.elimination import SIGMAS
from unmodelled.diagnosis.judge.judgement import Judgement
from unmodelled.diagnosis.judge.last_fits import LastFit
from unmodelled.diagnosis.judge.left_out import LeftOutRuns, probabilities
from unmodelled.diagnosis.judge.looks import Look
from unmodelled.diagnosis.judge.refit import Refit
from unmodelled.diagnosis.judge.residual import Residual
from unmodelled.effects.added import Added

#: Candidates that are listed.
LISTED = 20


@dataclass(frozen=True, eq=False)
class Candidate:
    """A fit that was compared: laws beside the known physics and its chain, or these alone."""

    effects: tuple[Added, ...]
    score: LeftOutRuns
    log_scores: Array  # with the price of its numbers, (experiments,)
    residual: Residual
    look: Look
    name: str = ""  # of its last law and place, "" where it has none

    def row(self, named: LeftOutRuns, probability: float | None) -> Compared:
        """Return nats per independent sample, paired differences by experiment, and errors in units."""
        samples, off = named.samples.sum(), named.log_scores - self.score.log_scores
        error = np.sqrt(len(off) * np.var(off, ddof=1)) if len(off) > 1 else np.nan
        each = (-self.score.log_scores.sum(), off.sum(), error)
        own, difference, error = (float(value / samples) for value in each)
        base = self.look.parent.base
        sizes = np.sqrt(self.residual.square) * base.recording.noise
        errors = dict(zip(base.recording.logs.outputs, sizes.tolist(), strict=True))
        shown = probability, errors, base.horizon
        return Compared(self.effects, own, difference, error, self.score is named, *shown)


def compared(
    found: Judgement, parts: Sequence[Added], sure: Sequence[tuple[float, Sequence[float]]]
) -> tuple[Compared, ...]:
    """Return the known physics and all refits by predictions of experiments left out, the best first.

    The known physics has its chain, of which some parts are effects where no law is. `sure` has the
    confidence of every law and the probabilities of the forms that are told, or of the answer without a law.
    """
    rows, known = list[tuple[Candidate, float | None]](), found.look.parent.score
    for k, look in enumerate(found.rounds):
        before, parent = tuple(law.speaker.added for law in found.laws[:k]), look.parent
        score, effects = parent.score, (*parts, *before)
        every = [Candidate(effects, score, score.log_scores, parent.residual, look)]
        every += [
            Candidate((*before, one.added), one.score, one.log_scores, one.residual, look, one.row.name)
            for one in _fitted(look)
        ]
        law = found.laws[k] if k < len(found.laws) else None
        calibrated = list(_with_probabilities(every, law, *sure[min(k, len(sure) - 1)]))
        rows += calibrated[k > 0 :]  # the fit beside which further laws stand is a row of the last round
    best = found.laws[-1].speaker.score if found.laws else known
    table = [one.row(best, probability) for one, probability in rows]
    own = next(row for row in table if row.named)
    others = sorted((row for row in table if not row.named), key=lambda row: row.score)
    families = {law.family for law in known_study(found).laws}  # of the user: always listed
    mine = [row for row in others[LISTED - 1 :] if row.effects and row.effects[-1].family in families]
    return tuple(sorted([own, *others[: LISTED - 1], *mine], key=lambda row: row.score))


def known_study(found: Judgement) -> Study:
    """Return the study at the length that decides."""
    return found.look.parent.fitted.hypothesis.study


def not_compared(found: Judgement) -> Iterator[str]:
    """Yield why a law of the user does not stand among the models that were compared."""
    compared_ones = {one.added.family for look in found.rounds for one in _fitted(look)}
    tried = {one.added.family for look in found.looks for one in look.refits}
    for law in known_study(found).laws:
        rows = [row for look in found.looks for row in look.rows if row.atom.effect.family == law.family]
        if law.family in compared_ones:
            continue
        best = max((row.nats for row in rows), default=None)
        if best is None:
            yield f"your law {law.family} can act nowhere in this system"
        elif law.family in tried:
            yield f"your law {law.family} was refitted, and leaves no less error than the model without it"
        else:
            yield (
                f"your law {law.family} was not refitted: one linear step of it is worth {best:.3g} nats "
                "after the price of its numbers, and other laws are worth more"
            )


def _with_probabilities(
    every: Sequence[Candidate], law: LawClass | None, confidence: float, told: Sequence[float]
) -> Iterator[tuple[Candidate, float | None]]:
    """Candidates of a round with calibrated probabilities; the first one is without a law more.

    The forms of the named class share its confidence as the answer tells them. A probability of the others
    is that of the comparison, calibrated by as much.
    """
    each = probabilities(np.stack([one.log_scores for one in every]))
    members = [one.row.name for one in law.members] if law else [""]
    others = [k for k, one in enumerate(every) if one.name not in members]
    own, rest = float(1.0 - each[others].sum()), float(each[others].sum())
    factor = min(confidence / max(own, 1e-300), (1.0 - confidence) / max(rest, 1e-300))
    shares = {k: float(factor * each[k]) for k in others}
    scores = [one.score for one in law.members] if law else [every[0].score]
    for share, score in zip(told, scores, strict=False):
        at = [k for k, one in enumerate(every) if one.score is score]
        shares |= dict.fromkeys(at, confidence * share / sum(told))
    yield from ((one, shares.get(k)) for k, one in enumerate(every))


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


def most_alike(found: Judgement) -> Evidence | None:
    """Return the law that is most like what is left where none is named."""
    if found.alike is None:
        return None
    one, horizon = found.alike.speaker, found.look.parent.base.horizon
    return Evidence(one.added, horizon, one.nats, one.removed)


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
