"""Which of the fitted models explains the gap: how many effects, which is named, what it cannot be told from.

Tolerances are relative to the noise of the sensors, not to the gap, which can be many times as large. The
constants below were chosen on cases of the withheld machines with seeds that no reported number uses.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from unmodelled.diagnosis.fitting.fitted import Fitted
from unmodelled.diagnosis.fitting.residuals import TUNING
from unmodelled.effects.added import Added

Array = NDArray[np.float64]

#: Loss per compared value that a unit of complexity must save.
PARSIMONY = 0.003
#: How many times as much at most, while something is missing.
MISSING = 4.0
#: Loss, a natural logarithm of a likelihood, that a model with an effect more must save, and per complexity.
SIGNIFICANT, PER_COMPLEXITY = 40.0, 3.0
#: Part of the square error beyond the noise that a further effect must explain.
FURTHER = 0.5
#: Square errors, relative to the noise, beyond 1: what is at the floor, and what is well above it, in all or
#: as a share of what the known physics leaves.
AT_FLOOR, ABOVE_FLOOR, ABOVE_SHARE = 0.05, 0.15, 0.04
#: The same, beyond which no model comes near the noise: then a unit of complexity must explain this share of
#: what the known physics leaves, as laws of the library take up what is none of theirs.
FAR, WORTH = 10.0, 0.005
#: Losses that cannot be told apart: in all, per value, and per value if experiments disagree (t < ALIKE_T).
ALIKE, ALIKE_EACH, ALIKE_MIXED, ALIKE_T = 10.0, 0.003, 0.005, 2.0
#: A model that is more complex than the named one is listed if it is better by so much, and at most so many.
BETTER, LISTED = 6.0, 3


@dataclass(frozen=True, eq=False)
class Scores:
    """Models that were fitted to the same recording, the known physics first, on a common scale.

    Attributes:
        fits: the models.
    """

    fits: tuple[Fitted, ...]

    @cached_property
    def losses(self) -> Array:
        """(models, experiments) Huber's loss of the errors, relative to the smallest spread that any of the
        models leaves, and how unlikely its starts are."""
        scale = np.min([f.spread for f in self.fits], axis=0)
        return np.stack([_losses(f, scale) for f in self.fits])

    @property
    def count(self) -> int:
        """Of values that are compared."""
        recording = self.fits[0].recording
        return int(recording.steps.sum()) * len(recording.noise)

    @cached_property
    def complexity(self) -> Array:
        """(models,)"""
        return np.array([f.hypothesis.complexity for f in self.fits])

    @cached_property
    def total(self) -> Array:
        """(models,) loss and complexity: the smaller the better."""
        return np.asarray(self.losses.sum(1) + PARSIMONY * self.count * self.complexity)

    def ranked(self, effects: int) -> list[int]:
        """Numbers of the models with so many effects, the best first.

        As long as something is missing, simple models are given more of a chance: a complex one may stand in
        for what is missing.
        """
        mine = [k for k, f in enumerate(self.fits) if len(f.hypothesis.effects) == effects]
        missing = min((max(above_floor(self.fits[k]), 0.0) for k in mine), default=0.0)
        price = PARSIMONY * self.count * min(1.0 + missing, MISSING)
        return sorted(mine, key=lambda k: float(self.losses[k].sum() + price * self.complexity[k]))

    def pays(self, now: int, more: int) -> bool:
        """Whether a model with one effect more is worth it."""
        saved = float(self.losses[now].sum() - self.losses[more].sum())
        if saved < SIGNIFICANT + PER_COMPLEXITY * self.complexity[more]:
            return False
        if not self.fits[now].hypothesis.effects:
            return True
        above = above_floor(self.fits[now])
        gained = above - above_floor(self.fits[more])
        return bool(
            self.total[more] < self.total[now] and not settled(self.fits[now]) and gained > FURTHER * above
        )

    def named(self) -> int:
        """The number of the model that is named: `chosen`, or a simpler one if none comes near the noise."""
        chosen = self.chosen()
        if not chosen or min(map(above_floor, self.fits)) <= FAR:
            return chosen
        simpler = [k for k in range(1, len(self.fits)) if self.complexity[k] < self.complexity[chosen]]
        price = WORTH * above_floor(self.fits[0])
        return min(
            [chosen, *simpler], key=lambda k: above_floor(self.fits[k]) + price * float(self.complexity[k])
        )

    def chosen(self) -> int:
        """The number of the model that explains the errors best for what it takes.

        Effects are added as long as it pays; then a model that is simpler, though it may have more effects,
        takes the place of one that explains no more than its numbers are worth.
        """
        now = self._grown()
        if not self.fits[now].hypothesis.effects:
            return now
        simpler = [k for k in range(1, len(self.fits)) if self.complexity[k] < self.complexity[now]]
        return min([now, *simpler], key=lambda k: float(self.total[k]))

    def _grown(self) -> int:
        now = 0
        while more := self.ranked(len(self.fits[now].hypothesis.effects) + 1):
            if not self.pays(now, more[0]):
                break
            now = more[0]
        return now

    def alike(self, named: int) -> Mapping[int, tuple[Added, ...]]:
        """By number of an effect of the named model: what these data cannot tell from it, the best first."""
        own = self.fits[named].hypothesis.effects
        found: dict[int, dict[tuple[str, str], Added]] = {k: {} for k in range(len(own))}
        for other in np.argsort(self.losses.sum(1)).tolist():
            swapped = _swapped(own, self.fits[other].hypothesis.effects)
            if swapped is not None and self._cannot_be_told(named, other):
                k, effect = swapped
                if _channel(effect) != _channel(own[k]) and len(found[k]) < LISTED:
                    found[k].setdefault(_channel(effect), effect)
        return {k: tuple(others.values()) for k, others in found.items()}

    def _cannot_be_told(self, named: int, other: int) -> bool:
        worse = self.losses[other] - self.losses[named]
        if self.complexity[other] > self.complexity[named] + 0.6:
            return bool(worse.sum() < -BETTER)
        deviation = np.std(worse, ddof=1) / np.sqrt(len(worse)) if len(worse) > 1 else np.inf
        mixed = worse.mean() < ALIKE_T * deviation and worse.sum() < ALIKE_MIXED * self.count
        return bool(mixed or worse.sum() < max(ALIKE, ALIKE_EACH * self.count))


def above_floor(fitted: Fitted) -> float:
    """Mean square of the errors that are left, in units of the sensors' noise, beyond that of the noise."""
    noise = fitted.recording.noise / fitted.recording.scale
    left = np.array(list(fitted.fit.left.per_output.values()))
    return float(np.mean((left / noise) ** 2)) - 1.0


def settled(fitted: Fitted) -> bool:
    """Whether nothing is left that a further effect could explain; a third one has to have a good reason."""
    return above_floor(fitted) <= (AT_FLOOR if len(fitted.hypothesis.effects) < 2 else ABOVE_FLOOR)


def explained(base: Fitted, fitted: Fitted) -> bool:
    """Whether what is left is no more than noise, or hardly anything of what was there."""
    return above_floor(fitted) <= max(ABOVE_FLOOR, ABOVE_SHARE * above_floor(base))


def _channel(effect: Added) -> tuple[str, str]:
    return effect.family, effect.place.channel


def _swapped(own: Sequence[Added], others: Sequence[Added]) -> tuple[int, Added] | None:
    """The number of the one effect of `own` that another one stands for among `others`, and that one."""
    mine, theirs = ({(e.family, e.variant, e.place): e for e in es} for es in (own, others))
    gone, new = mine.keys() - theirs.keys(), theirs.keys() - mine.keys()
    if len(own) != len(others) or len(gone) != 1:
        return None
    effect = mine[next(iter(gone))]
    return list(own).index(effect), theirs[next(iter(new))]


def _losses(fitted: Fitted, scale: Array) -> Array:
    r, moved = fitted.errors
    size = np.abs(r) / scale
    each = np.where(size <= TUNING, 0.5 * size**2, TUNING * (size - 0.5 * TUNING)).sum((1, 2))
    each += 0.5 * np.sum(moved**2, axis=1)
    owner = fitted.recording.owner
    return np.array([each[owner == i].sum() for i in sorted(fitted.recording.runs)])
