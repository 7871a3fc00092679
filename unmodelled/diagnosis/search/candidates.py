"""Fitted candidates on one scale: losses per experiment, penalty for complexity, and which one leads.

Thresholds are relative to the noise of the sensors, not to the gap, which can be many times as large.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from unmodelled.diagnosis.data.thresholds import DEFAULT_THRESHOLDS, Thresholds
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis
from unmodelled.diagnosis.fitting.residuals import TUNING

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Candidates:
    """Hypotheses that were fitted to the same recording.

    Attributes:
        fits: fitted hypotheses; the first is the known physics.
        thresholds: thresholds of the ranking.
    """

    fits: tuple[FittedHypothesis, ...]
    thresholds: Thresholds = DEFAULT_THRESHOLDS

    @cached_property
    def losses(self) -> Array:
        """Return Huber's loss of every candidate in every experiment.

        Errors are in units of the smallest robust spread that any candidate leaves; the loss includes how
        unlikely the fitted initial states are.

        Returns:
            Negative logarithm of a likelihood, shape (candidates, experiments).
        """
        scale = np.min([f.spread for f in self.fits], axis=0)
        return np.stack([_losses(f, scale) for f in self.fits])

    @property
    def count(self) -> int:
        """Return the number of compared values: samples times outputs."""
        recording = self.fits[0].recording
        return int(recording.steps.sum()) * len(recording.noise)

    @cached_property
    def complexity(self) -> Array:
        """Return the complexity, shape (candidates,), of the effects of every candidate."""
        return np.array([f.hypothesis.complexity for f in self.fits])

    @cached_property
    def penalised(self) -> Array:
        """Return loss plus penalty, shape (candidates,); the smallest is the best."""
        penalty = self.thresholds.penalty * self.count * self.complexity
        return np.asarray(self.losses.sum(1) + penalty)

    def ranked(self, effects: int) -> list[int]:
        """Return the numbers of the candidates with so many effects, the best first.

        While a large gap remains, the penalty is larger: a complex effect may stand in for a missing one.

        Args:
            effects: number of effects.
        """
        mine = [k for k, f in enumerate(self.fits) if len(f.hypothesis.effects) == effects]
        missing = min((max(noise_ratio(self.fits[k]), 0.0) for k in mine), default=0.0)
        factor = min(1.0 + missing, self.thresholds.largest_penalty_factor)
        price = self.thresholds.penalty * self.count * factor
        return sorted(mine, key=lambda k: float(self.losses[k].sum() + price * self.complexity[k]))

    def pays(self, now: int, more: int) -> bool:
        """Return whether a candidate with one effect more is significantly better.

        Args:
            now: number of the candidate.
            more: number of the candidate with one effect more.
        """
        limits = self.thresholds
        saved = float(self.losses[now].sum() - self.losses[more].sum())
        least = limits.significant_loss + limits.significant_loss_per_complexity * self.complexity[more]
        if saved < least:
            return False
        if not self.fits[now].hypothesis.effects:
            return True
        before = noise_ratio(self.fits[now])
        gained = before - noise_ratio(self.fits[more])
        return bool(
            self.penalised[more] < self.penalised[now]
            and not self.at_floor(self.fits[now])
            and gained > limits.further_share * before
        )

    def leading(self) -> int:
        """Return the number of the candidate that explains the errors best for its complexity.

        Effects are added as long as that pays. Then a simpler candidate, of any number of effects, takes the
        place of one that explains no more than its complexity is worth.
        """
        now = self._grown()
        if not self.fits[now].hypothesis.effects:
            return now
        simpler = [k for k in range(1, len(self.fits)) if self.complexity[k] < self.complexity[now]]
        return min([now, *simpler], key=lambda k: float(self.penalised[k]))

    def at_floor(self, fitted: FittedHypothesis) -> bool:
        """Return whether too little remains for one more effect; a third effect needs more than a second.

        Args:
            fitted: fitted candidate.
        """
        few = len(fitted.hypothesis.effects) < 2
        return noise_ratio(fitted) <= (self.thresholds.at_floor if few else self.thresholds.above_floor)

    def _grown(self) -> int:
        now = 0
        while more := self.ranked(len(self.fits[now].hypothesis.effects) + 1):
            if not self.pays(now, more[0]):
                break
            now = more[0]
        return now


def noise_ratio(fitted: FittedHypothesis) -> float:
    """Return the mean square of the remaining errors, in variances of the sensor noise, less one.

    Args:
        fitted: fitted candidate.
    """
    noise = fitted.recording.noise / fitted.recording.scale
    left = np.array(list(fitted.fit.left.per_output.values()))
    return float(np.mean((left / noise) ** 2)) - 1.0


def _losses(fitted: FittedHypothesis, scale: Array) -> Array:
    r, moved = fitted.errors
    size = np.abs(r) / scale
    each = np.where(size <= TUNING, 0.5 * size**2, TUNING * (size - 0.5 * TUNING)).sum((1, 2))
    each += 0.5 * np.sum(moved**2, axis=1)
    owner = fitted.recording.owner
    return np.array([each[owner == i].sum() for i in sorted(fitted.recording.runs)])
