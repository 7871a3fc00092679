"""Fitted candidates on one scale: how well each predicts experiments that took no part in its fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from unmodelled.base.arrays import Array, Indices, Mask
from unmodelled.diagnosis.core.comparison import Comparison
from unmodelled.diagnosis.data.persistence import persistence
from unmodelled.diagnosis.data.thresholds import DEFAULT_THRESHOLDS, Thresholds
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis
from unmodelled.diagnosis.fitting.left_out import LeftOut, divided, parts
from unmodelled.effects.added import DISCOVERED, Added
from unmodelled.effects.place import Place

#: Share of the difference of two candidates that the compared experiments hold at least.
NEARLY_ALL = 0.95
#: Complexity of a number: up to that, complexities differ by how rare laws are.
ONE_NUMBER = 1.0


@dataclass(frozen=True, eq=False)
class Candidates:
    """Hypotheses that were fitted to the same recording."""

    predictions: tuple[LeftOut, ...]  # the first is the known physics
    thresholds: Thresholds = DEFAULT_THRESHOLDS
    _compared: dict[tuple[int, int], Comparison] = field(default_factory=dict, init=False, repr=False)

    @property
    def fits(self) -> tuple[FittedHypothesis, ...]:
        """Return the fitted hypotheses."""
        return tuple(prediction.fitted for prediction in self.predictions)

    @cached_property
    def _keys(self) -> list[frozenset[tuple[str, str, Place]]]:
        """Family, variant and place of every effect, by candidate."""
        return [f.hypothesis.key for f in self.fits]

    @cached_property
    def _by_output(self) -> Array:
        """Scores, shape (candidates, parts, outputs), nats."""
        return np.stack([prediction.scores() for prediction in self.predictions])

    @cached_property
    def scores(self) -> Array:
        """Return the scores of all candidates, shape (candidates, parts), nats."""
        return np.asarray(self._by_output.mean(2))

    @cached_property
    def remaining(self) -> Array:
        """Return the error of every candidate, shape (candidates,), relative to that of the known physics.

        It is the root mean square error of left-out predictions, the geometric mean over parts and outputs.
        """
        return np.asarray(np.exp(0.5 * (self.scores - self.scores[0]).mean(1)))

    @cached_property
    def _errors(self) -> Array:
        """The same for every output, shape (candidates, outputs)."""
        return np.asarray(np.exp(0.5 * (self._by_output - self._by_output[0]).mean(1)))

    @cached_property
    def persistence(self) -> float:
        """Return the error of a prediction without a model, in standard deviations of the outputs."""
        return persistence(self.predictions[0].fitted.recording)

    @cached_property
    def complexity(self) -> Array:
        """Return the complexity, shape (candidates,), of the effects of every candidate."""
        return np.array([f.hypothesis.complexity for f in self.fits])

    @cached_property
    def numbers(self) -> Indices:
        """Return how many numbers of effects, shape (candidates,), every candidate has."""
        return np.array([f.hypothesis.numbers for f in self.fits])

    @cached_property
    def steps(self) -> Indices:
        """Return the number, shape (candidates,), of effects; a law at many ports of one kind counts once."""
        return np.array([len(f.hypothesis.together) for f in self.fits])

    @cached_property
    def own(self) -> Indices:
        """Return the number, shape (candidates,), of effects that differ between experiments."""
        return np.array([sum(bool(e.per_experiment) for e in f.hypothesis.effects) for f in self.fits])

    @cached_property
    def _formulas(self) -> Mask:
        """Mask, shape (candidates,), of those with a law that the library lacks."""
        return np.array([any(family == DISCOVERED for family, *_ in key) for key in self._keys])

    def gain(self, before: int, after: int) -> Comparison:
        """Compare the predictions of two candidates.

        Where experiments do not tell a difference from chance because they are too few, such as those of an
        end stop that one motion reaches, or of an effect at one level of a factor, their blocks are compared.
        """
        if (before, after) not in self._compared:
            found = Comparison.of(self.scores[before] - self.scores[after])
            if not found.is_significant(self.thresholds.level):
                few = self._different(before, after)
                if few:
                    one, two = (self.predictions[k].score(few) for k in (before, after))
                    found = Comparison.of(one - two)
            self._compared[before, after] = found
        return self._compared[before, after]

    def beats(self, one: int, other: int, *, priced: bool = True) -> bool:
        """Return whether a candidate predicts better by more than chance and by a material amount."""
        material = self.is_material(one, other, priced=priced)
        return material and self.gain(other, one).is_significant(self.thresholds.level)

    def is_material(self, one: int, other: int, *, priced: bool = True) -> bool:
        """Return whether a candidate predicts better by a material amount.

        It must lower what is left of an output's error above the noise by a share: an effect at one of six
        joints matters to the outputs of this joint. A more complex one must also remove a share of the gap in
        proportion to its further complexity, because every model of a real machine leaves errors that a
        flexible law lowers, or explain what is left as an `effect` explains a gap, however small that is
        beside a larger effect. Numbers of single experiments, which absorb any structure, must remove more
        of what is left. Errors below `negligible_error` matter to no one: a sensor of little noise
        shows more than any model needs to predict.
        """
        limits, (after, before) = self.thresholds, self._errors[[one, other]]
        if self.remaining[one] >= self.remaining[other]:
            return False
        more = self._more_complex(one, other) if priced else 0.0
        left, rest = self._above[[one, other]]
        own = bool(self.own[one] > self.own[other])
        material = left < (1.0 - (limits.further_rest if own else limits.material_rest)) * rest
        explains = left <= limits.further_rest * rest
        material &= explains | (before - after >= limits.material_share * more * self._gap)
        material &= self._removed(one, other) >= limits.negligible_error
        return bool(material.any())

    def _more_complex(self, one: int, other: int) -> float:
        """Further complexity of a candidate; none where it has no more numbers: it bends no further."""
        further = float(self.complexity[one] - self.complexity[other])
        return max(further, 0.0) if self.numbers[one] > self.numbers[other] else 0.0

    @cached_property
    def _noise(self) -> Array:
        """Sensor noise (outputs,) in errors of persistence."""
        recording = self.predictions[0].fitted.recording
        return np.asarray(recording.noise / recording.scale / self.persistence)

    @cached_property
    def _above(self) -> Array:
        """Error (candidates, outputs) above the sensor noise, in that noise."""
        return np.asarray(np.sqrt(np.maximum(np.exp(self._by_output.mean(1)) - 2.0, 0.0)))

    @cached_property
    def _gap(self) -> Array:
        """Error (outputs,) of the known physics or of persistence if that is lower, in that of the former."""
        known = self._noise * np.exp(0.5 * self._by_output[0].mean(0))
        return np.asarray(np.minimum(1.0, 1.0 / known))

    @cached_property
    def costs(self) -> Array:
        """Return the error plus the price of complexity, shape (candidates,), as shares of the gap."""
        errors = (self._errors / self._gap).mean(1)
        return np.asarray(errors + self.thresholds.material_share * self.complexity)

    def _removed(self, one: int, other: int) -> Array:
        """Error (outputs,) that the first candidate removes where it removes most, in that of persistence."""
        squares = np.exp(self._by_output[other]) - np.exp(self._by_output[one])
        return np.asarray(self._noise * np.sqrt(np.maximum(squares.max(0), 0.0)))

    def named(self) -> int:
        """Return the number of the candidate to name: the simplest one that no other candidate beats.

        A candidate counts only if each of its effects pays. It is not named where another one that is no
        more complex has the lower error: it may be unbeaten only because its errors differ from those of the
        others in both directions. Numbers of single experiments and formulas, which were chosen among many,
        are named only if they beat the best laws of the library.
        """
        sound = np.flatnonzero(self.sound).tolist()
        flexible = (self.own > 0) | self._formulas
        law = self._simplest([k for k in sound if not flexible[k]])
        better = [k for k in sound if flexible[k] and self.beats(k, law)]
        return self._simplest(better) if better else law

    @cached_property
    def sound(self) -> Mask:
        """Return which (candidates,) beat all fitted ones with one of `Hypothesis.units` less."""
        return np.array([self._is_sound(k) for k in range(len(self.fits))])

    def _is_sound(self, candidate: int) -> bool:
        own = self._keys[candidate]
        units = {frozenset(e.key for e in unit) for unit in self.fits[candidate].hypothesis.units}
        fewer = [k for k, key in enumerate(self._keys) if key < own and own - key in units]
        return all(self.beats(candidate, k) for k in fewer)

    def _simplest(self, among: Sequence[int]) -> int:
        """The simplest one of those whose complexity pays (Pareto front) that none of the others beats."""
        best = sorted(among, key=lambda k: float(self.remaining[k]))
        order = sorted(best, key=lambda k: float(self.complexity[k]))
        lowest = np.minimum.accumulate([np.inf, *self.remaining[order]])
        front = [k for k, low in zip(order, lowest[:-1], strict=True) if self.remaining[k] < low]
        return next(k for k in front if not any(self.beats(other, k) for other in best))

    def promising(self, steps: int) -> list[int]:
        """Return the numbers of the candidates with so many effects, those of the lowest cost first."""
        return sorted(np.flatnonzero(self.steps == steps).tolist(), key=lambda k: float(self.costs[k]))

    def alike(self, named: int, other: int) -> bool:
        """Return whether the data do not speak against a candidate in place of the named one.

        A more complex candidate, such as one that contains the named law, is no other explanation.
        """
        simple = self._more_complex(other, named) < ONE_NUMBER
        return simple and not self.beats(named, other, priced=False)

    def leaves_little(self, candidate: int) -> bool:
        """Return whether the error above the noise that a candidate leaves is negligible in all outputs."""
        return bool(np.all(self._noise * self._above[candidate] < self.thresholds.negligible_error))

    def as_good(self, named: int) -> list[int]:
        """Return the other candidates than which the named one is not materially better."""
        others = (k for k in range(len(self.predictions)) if k != named)
        return [k for k in others if not self.is_material(named, k, priced=False)]

    def _different(self, before: int, after: int) -> list[int]:
        """Experiments that hold nearly all of the difference; none if they are enough for a test."""
        recording = self.predictions[0].fitted.recording
        runs, run = np.unique(recording.owner, return_inverse=True)
        owner = np.zeros(self.scores.shape[1], np.int64)
        owner[parts(recording)] = run
        size = np.bincount(owner, np.abs(self.scores[before] - self.scores[after]))
        order = np.argsort(-size)
        few = 1 + int(np.searchsorted(np.cumsum(size[order]), NEARLY_ALL * size.sum()))
        too_few = 0.5**few > 1.0 - self.thresholds.level and divided(few) > divided(len(runs))
        return runs[order[:few]].tolist() if too_few else []


def exchanged(own: Sequence[Added], others: Sequence[Added]) -> tuple[int, Added] | None:
    """Return the one effect that another candidate exchanges."""
    mine, theirs = ({e.key: e for e in es} for es in (own, others))
    gone, new = mine.keys() - theirs.keys(), theirs.keys() - mine.keys()
    if len(own) != len(others) or len(gone) != 1:
        return None
    effect = mine[next(iter(gone))]
    return list(own).index(effect), theirs[next(iter(new))]
