"""The parts of a diagnosis by evidence: effects with their numbers and shares, chain, comparison, notes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from unmodelled.diagnosis.answer.chain_sentences import (
    chain_explains,
    small_gap,
    without_common_delay,
)
from unmodelled.diagnosis.answer.compared import (
    chain_parts,
    chance_of_nothing,
    compared,
    evidence,
    left_by_best,
    most_alike,
    not_compared,
    probability_of,
    strangers,
)
from unmodelled.diagnosis.answer.models import Models
from unmodelled.diagnosis.answer.shares import share_interval, shares
from unmodelled.diagnosis.data.gap import shrink
from unmodelled.diagnosis.data.remark import Remark, listed
from unmodelled.diagnosis.data.result import (
    DiagnosedEffect,
    Diagnosis,
    Estimate,
    FitEnd,
    LogFault,
    Remainder,
)
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.doubts.confidence import MOST, of_law, of_no_law
from unmodelled.diagnosis.doubts.numbers import Numbers
from unmodelled.diagnosis.doubts.undetermined import remarks
from unmodelled.diagnosis.doubts.usual_mistakes import usual_mistake
from unmodelled.diagnosis.judge.chain import chain_of
from unmodelled.diagnosis.judge.classes import best_class
from unmodelled.diagnosis.judge.judgement import Judgement
from unmodelled.effects.added import Added


@dataclass(frozen=True, eq=False)
class Named:
    """A law, or a part of the measurement chain, that is an effect."""

    law: Added  # as it leaves
    kind: str
    alike: tuple[Added, ...]  # what the logs cannot tell from it
    probabilities: tuple[float, ...]  # of it and of those alike, in their order
    confidence: float


@dataclass(frozen=True, eq=False)
class Answered:
    """All that an answer is made of."""

    study: Study
    found: Judgement
    models: Models
    between: tuple[str, ...]  # ports that were added between others, at which laws act

    @cached_property
    def numbers(self) -> Numbers:
        """Return the numbers that leave."""
        return Numbers(self.models.augmented.last)

    @property
    def shrink(self) -> float:
        """Return the share of the squared gap above the noise floor that the model which leaves explains."""
        gap = self.models.augmented.model.gap
        return shrink(self.models.steps[0].gap.value, gap.value, gap.floor)

    @cached_property
    def doubts(self) -> tuple[Remark, ...]:
        """Return remarks on numbers that leave, but for those of the measurement chain."""
        fitted = self.models.augmented.last.fitted
        chain = {name for part in chain_of(fitted.hypothesis) for name in part.units}
        return tuple(r for r in remarks(self.numbers) if not chain.intersection(r.numbers))

    def estimate(self, name: str, unit: str, known: float) -> Estimate:
        """Return a number with its interval and the kinds of the remarks on it."""
        found = self.numbers.estimate(name, unit, known, self.study.options.level)
        kinds = dict.fromkeys(doubt.kind for doubt in self.doubts if name in doubt.numbers)
        return replace(found, remarks=tuple(kinds))

    @property
    def fit(self) -> FitEnd:
        """Return how the fit of the numbers that leave ended."""
        fit = self.models.augmented.last.fitted.fit
        return FitEnd(fit.converged, fit.simulations)

    @cached_property
    def named(self) -> list[Named]:
        """Return the named laws in the order in which they were found, and the named part of the chain."""
        leaving = {law.key: law for law in self.models.augmented.last.laws}
        found = [
            Named(
                leaving[law.speaker.added.key],
                law.kind,
                tuple(one.added for one in law.members[1:]),
                tuple(law.probabilities.tolist()),
                of_law(probability_of(self.found.rounds[k], law) * self.found.final.explained, k),
            )
            for k, law in enumerate(self.found.laws)
        ]
        part = self.models.part
        if part is None:
            return found
        added, each = leaving[part.added.key], tuple(part.probabilities.tolist())
        return [*found, Named(added, part.kind, part.alike, each, of_law(part.explains, 0))]

    @property
    def laws(self) -> list[Added]:
        """Return what is named, as it leaves."""
        return [one.law for one in self.named]


def assembled(answered: Answered, faults: tuple[LogFault, ...]) -> Diagnosis:
    """Return the diagnosis of a judgement.

    It is as sure as the least sure of its laws; without a law, the less sure the more the best law that
    stands explains.
    """
    study, found, models = answered.study, answered.found, answered.models
    before, after, floor = models.steps[0], models.augmented.model, models.augmented.model.gap.floor
    chance = chance_of_nothing(found.look)
    noise = floor**2 / after.gap.value**2 if after.gap.value > 0.0 else 1.0
    system = study.system
    confidence = min(
        (one.confidence for one in answered.named),
        default=of_no_law(left_by_best(found.look), min(1.0, noise)),
    )
    reported = [n for law in answered.laws for n in law.reported if n not in law.per_experiment]
    return Diagnosis(
        *(system, study.logs, study.horizon, study.seed, found.verdict),
        confidence=confidence,
        chance=chance,
        effects=_effects(answered),
        remainder=_remainder(answered),
        known=models.known,
        reidentified=before,
        augmented=after,
        neural=models.neural,
        steps=models.steps,
        floor=floor,
        shrink=answered.shrink,
        interval=share_interval([before, after], 0, 1, study.seed),
        held_out=tuple(range(len(study.logs))),
        parameters={
            p.name: answered.estimate(p.name, p.unit, p.value)
            for p in system.parameters
            if p.name in system.uncertain
        },
        comparison=compared(found, *_told(answered, confidence)),
        notes=(*study.logs.notes, *_notes(answered)),
        faults=faults,
        correlations=answered.numbers.correlations([*reported, *system.uncertain]),
        chain=without_common_delay(chain_parts(found, models.chained.last)),
        evidence=evidence(found),
        alike=most_alike(found),
        strangers=strangers(found),
        fit=answered.fit,
    )


def _told(answered: Answered, confidence: float) -> tuple[list[Added], list[tuple[float, tuple[float, ...]]]]:
    """The named part of the chain where no law is, and how sure the laws and their forms are."""
    models, most = answered.models, 1 + answered.study.options.most_equal
    laws = answered.named[: len(answered.found.laws)]
    parts = [] if models.part is None or laws else [models.part.added]
    sure = [(one.confidence, one.probabilities[:most]) for one in laws]
    return parts, sure or [(confidence, (1.0,))]


def _effects(answered: Answered) -> tuple[DiagnosedEffect, ...]:
    """Effects with their shares of the gap, the largest first."""
    steps, most = answered.models.steps, answered.study.options.most_equal
    squares, floor = np.array([step.gap.value**2 for step in steps]), steps[-1].gap.floor
    effects, logs = [], answered.models.augmented.model.logs
    for k, one in enumerate(answered.named):
        law, own = one.law, one.law.per_experiment
        shared = [n for n in law.reported if n not in own]
        effects.append(
            DiagnosedEffect(
                law,
                {n: answered.estimate(n, law.units[n], np.nan) for n in shared},
                own={n: dict(zip(logs.ids, logs.experiments[n].tolist(), strict=True)) for n in own},
                confidence=one.confidence,
                shrink=float(shares(squares, floor, k, k + 1)),
                interval=share_interval(steps, k, k + 1, answered.study.seed),
                indistinguishable=one.alike[:most],
                step=k,
                kind=one.kind,
                probabilities=one.probabilities[: 1 + most],
            )
        )
    return tuple(sorted(effects, key=lambda effect: -effect.shrink))


def _remainder(answered: Answered) -> Remainder | None:
    """What the models leave where that is more than the sensors' noise, and what a network predicts of it.

    A network predicts a part beyond chance if the bootstrap over experiments says so.
    """
    models, seed = answered.models, answered.study.seed
    if answered.found.verdict not in ("main_effect", "unknown"):
        return None
    steps = models.steps[0], models.augmented.model, models.neural
    before, after, flexible = (model.gap.value**2 for model in steps)
    beyond_chance = share_interval(steps, 1, 2, seed)[0] > 0.0
    left, predicted = (value / before if before > 0.0 else 0.0 for value in (after, after - flexible))
    return Remainder(min(1.0, left), min(1.0, predicted) if beyond_chance and predicted > 0.0 else 0.0, None)


def _notes(answered: Answered) -> Iterator[str]:
    """Notes on inputs, added ports, a gap too small to name a law, and the gaps of models."""
    held = [item.name for item in answered.study.system.inputs if item.hold]
    if held:
        yield f"inputs keep their values between samples (hold: true): {', '.join(held)}"
    if answered.between:
        yield (
            f"the system file has no port {listed(answered.between)}: its effort acts between two "
            "ports, its coordinates are those of the first port less those of the second one"
        )
    chain = chain_parts(answered.found, answered.models.chained.last)
    if not answered.laws and answered.shrink >= MOST and without_common_delay(chain):
        yield chain_explains(answered.shrink)
    yield from _too_small(answered.found)
    yield from not_compared(answered.found)
    yield from (doubt.sentence for doubt in answered.doubts)
    known = {p.name: p for p in answered.study.system.parameters}
    for law in (law for law in answered.laws if law.is_other_value):
        given, (error,) = known[law.place.name], law.amplitudes
        yield from filter(None, [usual_mistake(given, given.value + answered.numbers.last.values[error])])
    if not answered.fit.converged:
        yield (
            f"the fit of the numbers ended after {answered.fit.evaluations} simulations while the error "
            "still fell: numbers may be off by more than their intervals; try a shorter horizon"
        )
    models = answered.models.known, answered.models.augmented.model
    for model in models:
        yield from (f"{model.label}: {note}" for note in model.gap.notes)


def _too_small(found: Judgement) -> Iterator[str]:
    """A note on the class that would explain a gap which matters at no length."""
    looks = () if found.laws or any(look.matters for look in found.looks) else reversed(found.looks)
    for look, one in ((look, best_class(look.refits)) for look in looks):
        if one is not None:
            base, parent = look.parent.base, look.parent
            share = base.share(parent.residual)
            output = base.recording.logs.outputs[int(np.argmax(share))]
            yield small_gap(output, float(share.max()), one.speaker.added, one.speaker.removed)
            return
