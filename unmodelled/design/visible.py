"""Effects that planned experiments could show, from which size on, and effects that would look alike.

An effect changes the free runs of the known physics in proportion to its size (the linearised sensitivity of
the screening). The part of the change that uncertain parameters, the timing of inputs and the initial states
cannot explain counts, in standard deviations of the sensor noise.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import orth
from scipy.special import ndtri

from unmodelled.diagnosis.data.persistence import default_horizon
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.search.screen import sets_of, tried
from unmodelled.diagnosis.search.tangent import Tangent
from unmodelled.effects.added import Added
from unmodelled.effects.library import effects
from unmodelled.effects.place import Place
from unmodelled.effects.scales import Scales
from unmodelled.explanation.identifiability import correlated
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System

Array = NDArray[np.float64]

#: Distance of two models, in standard deviations, at which an experiment tells them apart with 95 %: the odds
#: of `next` are the normal distribution function at half the distance.
DISTANCE = 2.0 * float(ndtri(0.95))
#: Starting points of an effect's shapes, and amount of an amplitude as a share of what a screening tries.
POINTS, SMALL = 6, 0.1
#: Correlation above which two effects look alike: that of a collinearity index of 5, as for parameters.
ALIKE_FROM = correlated(5.0)
#: Samples that are compared, about: sensitivities of more would not differ.
SAMPLES = 20_000


@dataclass(frozen=True, eq=False)
class Visible:
    """An effect along planned experiments.

    Attributes:
        added: effect at its place.
        number: name of its amplitude, delay or shape.
        size: smallest size that shows with 95 %, SI; of an effect that is not in proportion to a size, the
            tried value with the smallest change that shows; None if nothing plausible shows.
        share: `size` as a share of the plausible size; None where there is none.
        column: change of the outputs by the effect that re-fitting cannot explain, shape (values,).
        spans: bases of the changes at every starting point of the shapes, each of shape (values, numbers).
    """

    added: Added
    number: str
    size: float | None
    share: float | None
    column: Array
    spans: tuple[Array, ...]

    def likeness(self, other: Visible) -> float:
        """Return how far another effect can stand in for this one: correlation, 0 to 1.

        Args:
            other: effect with any size and any of its starting shapes.
        """
        norm = float(np.linalg.norm(self.column))
        found = [float(np.linalg.norm(span.T @ self.column)) for span in other.spans]
        return min(max(found, default=0.0) / norm, 1.0) if norm else 0.0


@dataclass(frozen=True, eq=False)
class Alike:
    """Two effects that would look alike.

    Attributes:
        one: effect that the other one can stand in for.
        other: the other effect.
        likeness: correlation of their changes after re-fitting, 0 to 1.
        told: size of the first effect from which the experiments tell both apart with 95 %, SI; None where no
            size does, or the effect is not in proportion to a size.
    """

    one: Visible
    other: Visible
    likeness: float
    told: float | None


class _Planned(Study):
    """Study of simulated logs, which lack no effort: a plausible effort is all that moves the port."""

    @cached_property
    def scales(self) -> Scales:
        found = super().scales
        return replace(found, effort=found.moving)


def visible(system: System, logs: Logs, noise: Array) -> list[Visible]:
    """Return the effects of the library along simulated logs, by family and place.

    Of the variants of a law, the simplest one counts. Effects that differ between experiments, or need
    another effect beside them, are left out.

    Args:
        system: known physics.
        logs: simulated logs.
        noise: standard deviation of the sensor noise, shape (outputs,), SI.
    """
    study = _Planned(system, logs, default_horizon(logs), ())
    known = Hypothesis.known(study)
    length = float(study.recording.steps.mean())
    recording = study.recording.thinned(max(8, round(SAMPLES / length)))
    tangent = Tangent(FittedHypothesis.of(known, recording), recording)
    base = _Refitted(tangent, noise, known, len(study.recording.start) / len(recording.start))
    found: dict[tuple[str, Place], Visible] = {}
    for effect in (each for each in effects() if not each.at_levels):
        for place in () if effect.beside else effect.places(system):
            added = known.plus(effect, place).effects[-1]
            if (effect.family, place) not in found and not (added.per_experiment or added.columns):
                found[effect.family, place] = base.effect(known.plus(effect, place))
    return sorted(found.values(), key=lambda one: (one.added.family, one.added.place.channel))


def alike(found: list[Visible]) -> Iterator[Alike]:
    """Yield the pairs of visible effects that would look alike, the most similar first.

    Their correlation is above that at which two parameters must be separated (`correlated`).

    Args:
        found: effects along the planned experiments.
    """
    shown = [one for one in found if one.size is not None]
    pairs = []
    for k, one in enumerate(shown):
        for other in shown[:k]:
            first, second = max((one, other), (other, one), key=lambda pair: pair[0].likeness(pair[1]))
            pairs.append((first.likeness(second), first, second))
    for likeness, one, other in sorted(pairs, key=lambda pair: -pair[0]):
        if likeness > ALIKE_FROM:
            rest = np.sqrt(1.0 - likeness**2)
            told = one.size / rest if one.size and not one.added.shares and rest > 1e-6 else None
            yield Alike(one, other, likeness, told)


class _Refitted:
    """Changes of the outputs that unknown numbers and initial states cannot explain.

    Initial states have unit variance in the units of the tangent, and numbers with bounds the variance of a
    uniform distribution; both are rows of an orthogonal projection.

    Args:
        tangent: derivatives along some windows of the simulated logs.
        noise: standard deviation of the sensor noise, shape (outputs,), SI.
        known: known physics.
        windows: number of all windows, relative to those of the tangent.
    """

    def __init__(self, tangent: Tangent, noise: Array, known: Hypothesis, windows: float) -> None:
        self.tangent, self.information = tangent, windows
        self.unit = tangent.recording.noise / noise
        count, slopes = len(tangent.r), tangent.own_slopes * self.unit
        starts = slopes[:, tangent.shared :].reshape(count, slopes.shape[1] - tangent.shared, -1)
        self.states = starts.shape[1]
        both = np.concatenate([starts.swapaxes(1, 2), np.tile(np.eye(self.states), (count, 1, 1))], axis=1)
        self.starts = np.linalg.qr(both)[0]
        self.numbers, columns, prior = np.empty((0, 0)), [], []
        owner = tangent.recording.owner
        for k, unknown in enumerate(known.unknowns):
            own = slopes[:, k : k + 1]
            runs = np.unique(owner) if unknown.own else [None]
            parts = [own if r is None else own * (owner == r)[:, None, None, None] for r in runs]
            columns += parts
            prior += len(parts) * [np.sqrt(12.0) * unknown.scale / (unknown.high - unknown.low)]
        if columns:
            seen = np.concatenate([self._without_starts(part) for part in columns])
            self.numbers = orth(np.concatenate([seen, np.diag(prior)], axis=1).T, 1e-9)
        self.priors = len(prior)

    def _without_starts(self, changes: Array) -> Array:
        """Changes (windows, n, steps, outputs) as rows (n, values) without what initial states explain."""
        flat = changes.reshape(*changes.shape[:2], -1).swapaxes(1, 2)
        flat = np.concatenate([flat, np.zeros((len(flat), self.states, flat.shape[2]))], axis=1)
        left = flat - self.starts @ (self.starts.swapaxes(1, 2) @ flat)
        return np.asarray(left.transpose(2, 0, 1).reshape(left.shape[2], -1))

    def __call__(self, changes: Array) -> Array:
        """Changes (windows, n, steps, outputs) as columns (values, n) that nothing else explains."""
        seen = self._without_starts(changes * self.unit)
        seen = np.concatenate([seen, np.zeros((len(seen), self.priors))], axis=1).T
        return np.asarray(seen - self.numbers @ (self.numbers.T @ seen)) if self.priors else seen

    def effect(self, hypothesis: Hypothesis) -> Visible:
        """The last effect of a hypothesis, at the starting point of its shapes at which it shows as usual."""
        added = hypothesis.effects[-1]
        names, chosen, sizes = tried(hypothesis, POINTS)
        sizes = sizes * np.array(
            [SMALL if n in added.amplitudes and n not in added.shares else 1.0 for n in names]
        )
        columns = self(self.tangent.slopes(hypothesis, sets_of(names, chosen, sizes)))
        columns = columns.reshape(len(columns), len(chosen), len(names))
        norms = np.sqrt(self.information) * np.linalg.norm(columns, axis=0)
        spans = tuple(orth(columns[:, k], 1e-9) for k in range(len(chosen)))
        if added.shares:
            shape = next(iter(added.shapes))
            strength = norms.max(axis=1)
            at = int(np.argmin(np.where(strength >= DISTANCE, strength, np.inf)))
            size = chosen[at][shape] if strength[at] >= DISTANCE else None
            return Visible(added, shape, size, None, columns[:, at, int(np.argmax(norms[at]))], spans)
        with np.errstate(divide="ignore"):
            least = sizes * DISTANCE / norms
        at = int(np.argsort(least.min(axis=1), kind="stable")[len(chosen) // 2])
        number = int(np.argmin(least[at]))
        name, size = names[number], float(least[at, number])
        plausible = added.scales[name]  # of a delay a sampling period, and its bound is the longest one
        shows = size <= (added.bounds[name][1] if name in added.delays else plausible)
        seen = (size, size / plausible) if shows else (None, None)
        return Visible(added, name, seen[0], seen[1], columns[:, at, number], spans)
