"""Short fits of many candidates over few windows, which rank them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from unmodelled.base.workers import threads_of
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis
from unmodelled.diagnosis.fitting.left_out import LeftOut
from unmodelled.diagnosis.fitting.unknowns import Start
from unmodelled.diagnosis.search.candidates import Candidates
from unmodelled.diagnosis.search.containing import Containing
from unmodelled.diagnosis.search.proposal import Proposal
from unmodelled.diagnosis.search.screen import Screened
from unmodelled.diagnosis.search.shared import Shared

#: One effect more than a hypothesis has, or a law in place of one that it contains.
One = Screened | Containing
#: What a fitted hypothesis may grow to: the same, or one law at several places.
Growth = One | Shared | Proposal

#: Share of the windows over which many numbers at once are fitted first.
BEGUN = 0.1
#: Iterations of a fit that only ranks candidates: a budget.
SCOUTING = 3
#: Families and places of which two laws each are scouted.
SCOUTED = 10
#: Complexity of the laws that are always scouted: those with one number.
SIMPLEST = 1.0
#: Levels of factors that are scouted the first time.
SCOUTED_LEVELS = 6


@dataclass(frozen=True, eq=False)
class Scouting:
    """Short fits of candidates.

    Attributes:
        known: the known physics, fitted.
        recording: few windows.
        workers: number of threads.
    """

    known: FittedHypothesis
    recording: Recording
    workers: int

    def ranked(self, parent: FittedHypothesis, chosen: Sequence[Growth]) -> list[tuple[Growth, Start]]:
        """Rank candidates by the cost of short fits: left-out error and price of complexity.

        The one with the lowest error comes first, whatever its price: it may explain what others leave. Then
        come those that are better than their parent by a material amount: beside a large effect, complexity
        alone would decide the order of costs. Of the laws of a family at a place, the best and the simplest
        one stay.

        Args:
            parent: fitted hypothesis that the candidates add to.
            chosen: candidates to fit.

        Returns:
            Candidates with the results of their fits, the best first.
        """
        with threads_of(self.workers) as pool:
            scouts = list(pool.map(self.short, chosen))
        before, thresholds = self.as_short(parent), self.known.hypothesis.study.thresholds
        scouted = Candidates((self._without, before, *scouts), thresholds)
        better = [scouted.is_material(2 + k, 1) for k in range(len(scouts))]
        costs, best = scouted.costs[2:], int(np.argmin(scouted.remaining[2:])) if scouts else 0
        order = sorted(range(len(scouts)), key=lambda k: (k != best, not better[k], costs[k]))
        families: dict[object, list[int]] = {}
        for k in order:
            families.setdefault(_kind(chosen[k]), []).append(k)
        kept = {
            k
            for laws in families.values()
            for k in (laws[0], min(laws, key=lambda n: _complexity(chosen[n])))
        }
        return [(chosen[k], scouts[k].fitted.fit.every) for k in order if k in kept]

    @cached_property
    def _without(self) -> LeftOut:
        """The known physics, fitted like the candidates."""
        return self._again(self.known)

    def as_short(self, fitted: FittedHypothesis) -> LeftOut:
        """Return the left-out predictions of a hypothesis that is fitted again, like the candidates.

        Args:
            fitted: fitted hypothesis; one without effects is the known physics.
        """
        return self._again(fitted) if fitted.hypothesis.effects else self._without

    def _again(self, fitted: FittedHypothesis) -> LeftOut:
        start, substeps = fitted.fit.every, fitted.fit.substeps
        short = FittedHypothesis.of(fitted.hypothesis, self.recording, [start], SCOUTING, substeps)
        return LeftOut.of(short)

    def short(self, candidate: Growth) -> LeftOut:
        """Return the left-out predictions of a candidate after a short fit.

        Args:
            candidate: candidate to fit.
        """
        substeps, larger, starts = candidate.base.fit.substeps, candidate.hypothesis, candidate.starts
        if len(larger.effects) > len(candidate.base.hypothesis.effects) + 1:
            # many numbers at once begin with short free runs, as the known physics does
            begun = FittedHypothesis.of(larger, self.recording.shortened(BEGUN), starts, substeps=substeps)
            starts = (begun.fit.every,)
        return LeftOut.of(FittedHypothesis.of(larger, self.recording, starts, SCOUTING, substeps))


def broad(found: Sequence[One]) -> list[One]:
    """Return every effect at every place, and the most promising ones at levels of factors.

    Effects that there are at levels only, such as the change of a parameter, do not compete with those that
    may as well act in all experiments.

    Args:
        found: candidates, the most promising first.
    """
    local = [one for one in found if one.place.factor is not None and one.gain > 0.0]
    everywhere = [one for one in found if one.place.factor is None]
    also, only = ([one for one in local if one.effect.at_levels is there] for there in (False, True))
    return [*everywhere, *also[:SCOUTED_LEVELS], *only[:SCOUTED_LEVELS]]


def promising(found: Sequence[One]) -> list[One]:
    """Return two laws of each of the most promising families and places: variants of one law are alike.

    An effect at one level is compared with the same effect in all experiments. Delays and the simplest laws
    come along whatever their gain: other numbers had to stand in for them and change by much, which no linear
    prediction tells.

    Args:
        found: candidates, the most promising first.
    """
    families: dict[object, list[One]] = {}
    for one in found:
        if one.gain > 0.0:
            families.setdefault(_kind(one), []).append(one)
    first = [one for laws in list(families.values())[:SCOUTED] for one in laws[:2]]
    local = {_everywhere(one) for one in first if one.place.factor is not None}
    chosen = {one.key for one in first}
    more = [
        one for one in found if one.place.factor is None and (_everywhere(one) in local or _is_usual(one))
    ]
    return [*first, *(one for one in more if one.key not in chosen)]


def _is_usual(one: One) -> bool:
    return one.is_delay or _complexity(one) <= SIMPLEST


def _complexity(one: Growth) -> float:
    return one.effect.complexity


def _kind(one: Growth) -> tuple[str, object]:
    return one.effect.family, one.place


def _everywhere(one: One) -> tuple[str, str, str]:
    return one.effect.family, one.effect.variant, one.place.channel
