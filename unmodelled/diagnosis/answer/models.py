"""The models that leave: known physics, laws, and the parts of the measurement chain that pay."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.diagnosis.answer.shares import shares
from unmodelled.diagnosis.data.gap import MATTERS, shrink
from unmodelled.diagnosis.data.result import JudgedModel
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.doubts.confidence import MOST
from unmodelled.diagnosis.fitting.judged_models import known_model
from unmodelled.diagnosis.judge.base import NOISES
from unmodelled.diagnosis.judge.chain import Key
from unmodelled.diagnosis.judge.classes import LEAST, NEAR_NATS, leaves_as_little
from unmodelled.diagnosis.judge.judgement import Judgement
from unmodelled.diagnosis.judge.last_fits import LastFit, last_fits, paying_chain, physics_fit
from unmodelled.diagnosis.judge.left_out import LeftOutRuns, probabilities
from unmodelled.diagnosis.judge.linear import Linearised
from unmodelled.effects.added import Added
from unmodelled.effects.effect import LawKind
from unmodelled.systems.model import System


@dataclass(frozen=True, eq=False)
class Leaving:
    """A model that leaves."""

    model: JudgedModel  # its gap is that of experiments left out
    last: LastFit
    followed: float  # gap of the experiments that it was fitted to

    @classmethod
    def of(cls, label: str, fits: Iterable[LastFit], every: Study) -> Leaving:
        """Return the fit with the smallest gap of experiments left out."""
        judged = [(fit, fit.judged(label, every)) for fit in fits]
        each = (cls(fit.left_out_of(model), fit, model.gap.value) for fit, model in judged)
        return min(each, key=lambda one: one.model.gap.value)

    @property
    def matters(self) -> bool:
        """Return whether the gap is above the noise of the sensors and a share of the motion."""
        gap = self.model.gap
        return gap.value > NOISES * gap.floor and gap.value > MATTERS * gap.persistence

    def gone(self, other: Leaving) -> float:
        """Return the share of the squared gap above the noise floor that another model removes."""
        gap = other.model.gap
        return shrink(self.model.gap.value, gap.value, gap.floor)


@dataclass(frozen=True, eq=False)
class Part:
    """A part of the measurement chain that is an effect: alone, it makes most of a gap that matters."""

    added: Added
    kind: LawKind
    explains: float  # share of the squared gap that the laws leave above the noise floor
    alike: tuple[Added, ...]  # parts that alone explain about as much
    probabilities: Array  # of the part and of those alike, (1 + alike,)


@dataclass(frozen=True, eq=False)
class Models:
    """Models with their gaps, experiments left out."""

    known: JudgedModel
    steps: tuple[JudgedModel, ...]  # re-identified, then with one law or named part of the chain more each
    augmented: Leaving
    chained: Leaving  # with the parts of the chain that pay; `augmented` where it has them
    neural: JudgedModel  # with a network in every port; `augmented` where nothing is left
    laws: int  # how many laws are effects
    part: Part | None  # of the chain, an effect beside the laws


def models_of(found: Judgement, system: System, every: Study) -> Models:
    """Fit and judge the models; parts of the chain alone leave only if the gap is smaller with them."""
    last, laws = found.final, [law.speaker.added.key for law in found.laws]
    chain, physics = paying_chain(last), Leaving.of("re-identified", [physics_fit(last, system)], every)
    steps = [physics, *_with_laws(found, system, every, chain)]
    many, augmented, chained = _many(steps, last.residual.white), steps[-1], steps[-1]
    if chain and len(steps) == 1:
        chained = Leaving.of("with the measurement chain", last_fits(last, system, (), chain), every)
        augmented = min(physics, chained, key=lambda one: one.model.gap.value)
    part = _part(found, system, every, chain, physics, chained) if many == len(laws) else None
    if part is not None:
        alike = [one.key for one in (part.added, *part.alike)]
        rest, named = [key for key in chain if key not in alike], [part.added.key]
        last_fit = last_fits(last, system, laws, [*rest, *named], named)
        steps = [physics, *_with_laws(found, system, every, rest)]
        steps.append(Leaving.of(_label(part.added), last_fit, every))
        augmented = chained = steps[-1]
    known, labelled = known_model(every), tuple(one.model for one in steps)
    return Models(known, labelled, augmented, chained, augmented.model, many, part)


def _with_laws(found: Judgement, system: System, every: Study, chain: Sequence[Key]) -> Iterator[Leaving]:
    """Models with one law more each, and parts of the chain."""
    laws = [law.speaker.added for law in found.laws]
    for k, law in enumerate(laws):
        fits = last_fits(found.final, system, [one.key for one in laws[: k + 1]], chain)
        yield Leaving.of(_label(law), fits, every)


def _label(added: Added) -> str:
    """What a model has that the one before it has not."""
    return f"with {added.title}"


def _many(steps: Sequence[Leaving], white: bool) -> int:
    """How many of the laws are effects; all of them may leave `white` noise.

    A law with which the model follows the experiments no better than without is none, nor is one that
    explains less than a twentieth of the squared gap, unless it leaves no more than noise.
    """
    many = min(range(len(steps)), key=lambda k: steps[k].followed)
    gaps, floor = np.array([one.model.gap.value for one in steps]), steps[-1].model.gap.floor
    noise = gaps < NOISES * floor
    noise[-1] |= white
    while many and shares(gaps**2, floor, many - 1, many) < LEAST and not noise[many]:
        many -= 1
    return many


def _part(
    found: Judgement,
    system: System,
    every: Study,
    chain: Sequence[Key],
    physics: Leaving,
    chained: Leaving,
) -> Part | None:
    """The part of the chain that alone explains most of what the laws leave, where that matters.

    Where something else is left there is none: a delay would stand in for it.
    """
    last, laws = found.final, [law.speaker.added.key for law in found.laws]
    if not chain or found.verdict not in ("effect", "no_gap"):
        return None
    without = Leaving.of("", last_fits(last, system, laws, ()), every) if laws else physics
    if not without.matters or without.gone(chained) < MOST:
        return None
    alone = [_Alone.of(key, list(last_fits(last, system, laws, [key], [key])), every) for key in chain]
    best = min(alone, key=lambda one: one.square)
    explains = without.gone(best.leaving)
    if explains < MOST:
        return None
    weights = best.varying.around.weights
    beside = {one: Linearised.of(one.varying.fitted, one.varying.tau, weights) for one in alone}
    near = [one for one in alone if _alike(beside[one], beside[best])]
    each = probabilities(np.stack([LeftOutRuns.of(beside[one]).log_scores for one in near]))
    order = np.argsort(-each)
    added, *others = (near[k].added for k in order)
    return Part(added, near[order[0]].kind, explains, tuple(others), each[order])


def _alike(one: Linearised, best: Linearised) -> bool:
    """Whether a fit leaves about as much as the best one, weighted alike, from fitted starts."""
    return best.evidence - one.evidence <= NEAR_NATS or leaves_as_little(one.squares, best.squares)


@dataclass(frozen=True, eq=False)
class _Alone:
    """The laws with one part of the chain alone."""

    added: Added
    kind: LawKind
    leaving: Leaving
    varying: LastFit  # with deviations of experiments, by which predictions are compared

    @classmethod
    def of(cls, key: Key, fits: Sequence[LastFit], every: Study) -> _Alone:
        hypothesis = fits[0].leaving
        pairs = zip(hypothesis.effects, hypothesis.laws, strict=True)
        added, law = next((e, law) for e, law in pairs if e.key == key)
        return cls(added, law.kind, Leaving.of("", fits, every), fits[0])

    @property
    def square(self) -> float:
        """Return the squared gap."""
        return self.leaving.model.gap.value**2
