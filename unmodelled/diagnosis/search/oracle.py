"""What a diagnosis could find at best: the effects are known, only their numbers are fitted."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.fitted import Fitted
from unmodelled.diagnosis.fitting.hypothesis import Hypothesis
from unmodelled.diagnosis.search.judged import Judged
from unmodelled.effects.effect import Effect
from unmodelled.effects.library import effects
from unmodelled.effects.place import Place
from unmodelled.evaluation.channels import parameter_channels
from unmodelled.evaluation.gap import shrink
from unmodelled.systems.model import System

#: Of the shapes of one variant: values that a fit starts from, at most.
STARTS = 64


@dataclass(frozen=True)
class Known:
    """An effect that is there: its family and where, see `Place`."""

    family: str
    channel: str
    factor: str | None = None
    level: float | str | None = None

    def candidates(self, system: System) -> Iterator[tuple[Effect, Place]]:
        """The variants of the family, wherever they act at this channel."""
        acts_at = parameter_channels(system)
        for effect in effects():
            if effect.family != self.family:
                continue
            for place in effect.places(system):
                if self.channel in (place.channel, *acts_at.get(place.channel, ())):
                    yield effect, replace(place, factor=self.factor, level=self.level)


@dataclass(frozen=True)
class Oracle:
    """What is left of the gap when the effects are known.

    Attributes:
        reidentified, augmented, floor: gaps on the held-out experiments, and the floor of the latter model.
            Without effects both gaps are the same.
        gap_seen: whether the reidentified model has a gap (`Judged.has_gap`).
        seen: by effect, whether the model without it, the other effects being known, is worse than with it
            (`Judged.is_worse_than`): else no diagnosis can be asked to find it.
        variants: by effect, which one of its family fitted best, or "" where there is but one.
    """

    reidentified: float
    augmented: float
    floor: float
    gap_seen: bool
    seen: tuple[bool, ...]
    variants: tuple[str, ...]

    @property
    def shrink(self) -> float:
        """By the definition of the contract; 0 where there is nothing to explain."""
        return shrink(self.reidentified, self.augmented, self.floor)


def oracle(study: Study, known: Sequence[Known]) -> Oracle:
    """Fit the physics with the effects that are there, and see what each of them is worth.

    Every variant of a family is tried, from starts all over its shapes; the one with the least gap on the
    experiments that are learned from stays. Of several effects the one that explains most comes first. An
    effect whose family is not in the library is left out.
    """
    named = [effect for effect in known if any(effect.candidates(study.system))]
    refits = _Refits(Fitted.of(Hypothesis.known(study), study.recording))
    best = refits.with_all(named)
    without, augmented = Judged.of(refits.base), Judged.of(best)
    seen = {}
    for k, effect in enumerate(named):
        others = refits.with_all([*named[:k], *named[k + 1 :]])
        seen[effect] = Judged.of(others).is_worse_than(augmented)
    chosen = {e.family: e for e in best.hypothesis.effects}
    return Oracle(
        reidentified=without.gap,
        augmented=augmented.gap,
        floor=augmented.floor,
        gap_seen=without.has_gap,
        seen=tuple(seen.get(effect, False) for effect in known),
        variants=tuple(chosen[e.family].variant if e.family in chosen else "" for e in known),
    )


class _Refits:
    """Fits of what is known, each of them done once.

    Args:
        base: without any effect.
    """

    def __init__(self, base: Fitted) -> None:
        self.base = base
        self._found: dict[tuple[Known, ...], Fitted] = {(): base}

    def with_all(self, known: Sequence[Known]) -> Fitted:
        """With all effects, the one that explains most first."""
        chosen: tuple[Known, ...] = ()
        while len(chosen) < len(known):
            ways = [(*chosen, effect) for effect in known if effect not in chosen]
            chosen = min(ways, key=lambda way: _gap(self._with(way)))
        return self._with(chosen)

    def _with(self, known: tuple[Known, ...]) -> Fitted:
        if known not in self._found:
            self._found[known] = _best(self._with(known[:-1]), known[-1])
        return self._found[known]


def _best(fitted: Fitted, effect: Known) -> Fitted:
    """One effect more: its best variant."""
    study = fitted.hypothesis.study
    found = []
    for variant, place in effect.candidates(study.system):
        hypothesis = fitted.hypothesis.plus(variant, place)
        shapes = hypothesis.effects[-1].shapes
        points = [dict(zip(shapes, values, strict=True)) for values in product(*shapes.values())]
        chosen = np.unique(np.linspace(0, len(points) - 1, STARTS).astype(int))
        starts = [{**fitted.fit.values, **points[k]} for k in chosen]
        found.append(Fitted.of(hypothesis, study.recording, starts))
    return min(found, key=_gap)


def _gap(fitted: Fitted) -> float:
    return fitted.fit.gap.value
