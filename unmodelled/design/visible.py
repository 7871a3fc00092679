"""Effects that planned experiments could show, from which size on, and effects that would look alike.

An effect changes the free runs of the known physics in proportion to its size (`diagnosis.columns`). The part
of the change that uncertain parameters, the timing of inputs and the initial states cannot explain counts, in
standard deviations of the sensor noise.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import orth
from scipy.special import ndtri

from unmodelled.base.arrays import Array
from unmodelled.design.identifiability import correlated
from unmodelled.diagnosis.columns.columns import Atom, Columns
from unmodelled.diagnosis.columns.path import Path
from unmodelled.diagnosis.data.persistence import default_horizon
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.effects.added import Added
from unmodelled.effects.place import Place
from unmodelled.effects.scales import Scales
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System

#: Distance of two models, in standard deviations, at which an experiment tells them apart with 95 %: the odds
#: of `next` are the normal distribution function at half the distance.
DISTANCE = 2.0 * float(ndtri(0.95))
#: Correlation above which two effects look alike: that of a collinearity index of 5, as for parameters.
ALIKE_FROM = correlated(5.0)
#: Samples that are compared, about: sensitivities of more would not differ.
SAMPLES = 20_000


@dataclass(frozen=True, eq=False)
class Visible:
    """An effect along planned experiments.

    Of an effect that is not in proportion to a size, the tried value with the smallest change that shows is
    its size.
    """

    added: Added
    number: str  # amplitude, delay or shape
    size: float | None  # smallest that shows with 95 %, SI; None: nothing plausible shows
    share: float | None  # of the plausible size; None where there is none
    column: Array  # (values,), change of the outputs by the effect that re-fitting cannot explain
    spans: tuple[Array, ...]  # bases (values, numbers) of the changes at every starting point of the shapes

    def likeness(self, other: Visible) -> float:
        """Return how far another effect can stand in for this one: correlation, 0 to 1."""
        norm = float(np.linalg.norm(self.column))
        found = [float(np.linalg.norm(span.T @ self.column)) for span in other.spans]
        return min(max(found, default=0.0) / norm, 1.0) if norm else 0.0


@dataclass(frozen=True, eq=False)
class Alike:
    """Two effects that would look alike: the other one can stand in for the first."""

    one: Visible
    other: Visible
    likeness: float  # correlation of their changes after re-fitting, 0 to 1
    told: float | None  # size of the first from which both are told apart with 95 %, SI; None: no size


class _Planned(Study):
    """Study of simulated logs, which lack no effort: a plausible effort is all that moves the port."""

    @cached_property
    def scales(self) -> Scales:
        found = super().scales
        return replace(found, effort=found.moving)


def visible(system: System, logs: Logs, noise: Array) -> list[Visible]:
    """Return the effects of the library along simulated logs, by family and place; noise (outputs,) in SI.

    Of the variants of a law, the one with the fewest numbers counts. Effects that differ between experiments,
    or need another effect beside them, are left out.
    """
    study = _Planned(system, logs, default_horizon(logs), ())
    known = Hypothesis.known(study)
    length = float(study.recording.steps.mean())
    recording = study.recording.thinned(max(8, round(SAMPLES / length)))
    columns = Columns(Path.of(FittedHypothesis.of(known, recording), recording))
    base = _Refitted(columns, noise, len(study.recording.start) / len(recording.start))
    found: dict[tuple[str, Place], Visible] = {}
    numbers: dict[tuple[str, Place], int] = {}
    for atoms, changes in columns.atoms():
        effect, place = atoms[0].effect, atoms[0].place
        key, many = (effect.family, place), atoms[0].numbers
        if effect.at_levels or effect.beside or many >= numbers.get(key, many + 1):
            continue
        added = known.plus(effect, place).effects[-1]
        if not added.columns:
            found[key], numbers[key] = base.effect(added, atoms, changes), many
    return sorted(found.values(), key=lambda one: (one.added.family, one.added.place.channel))


def alike(found: list[Visible]) -> Iterator[Alike]:
    """Yield the pairs of visible effects that would look alike, the most similar first.

    Their correlation is above that at which two parameters must be separated (`correlated`).
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

    Initial states have the variance of the sensor noise (outputs,), SI, and numbers with bounds the variance
    of a uniform distribution; both are rows of an orthogonal projection. `windows` is the number of all
    windows, relative to those of the columns.
    """

    def __init__(self, columns: Columns, noise: Array, windows: float) -> None:
        recording, starts = columns.path.recording, columns.starts
        self.information, self.unit = windows, (recording.noise / noise)[:, None]
        count, self.states = len(starts), starts.shape[3]
        prior = np.tile(np.eye(self.states), (count, 1, 1))
        flat = (starts * self.unit).reshape(count, starts.shape[1] * starts.shape[2], self.states)
        self.starts = np.linalg.qr(np.concatenate([flat, prior], axis=1))[0]
        runs = [columns.path.owner == run for run in np.unique(columns.path.owner)]
        mine = [columns.own.columns * run[:, None, None, None] for run in runs]
        known = np.concatenate([columns.open.columns, *mine], axis=3)
        width = np.concatenate([columns.open.prior, np.tile(columns.own.prior, len(runs))])
        self.numbers, self.priors = np.empty((0, 0)), known.shape[3]
        if self.priors:
            # of a uniform distribution, half the width is the square root of three standard deviations
            seen = np.concatenate([self._without_starts(known), np.diag(np.sqrt(3.0) / width)])
            self.numbers = orth(seen, 1e-9)

    def _without_starts(self, changes: Array) -> Array:
        """Changes (windows, K, outputs, n) as columns (values, n) without what initial states explain."""
        flat = (changes * self.unit).reshape(len(changes), -1, changes.shape[3])
        flat = np.concatenate([flat, np.zeros((len(flat), self.states, flat.shape[2]))], axis=1)
        left = flat - self.starts @ (self.starts.swapaxes(1, 2) @ flat)
        return np.asarray(left.reshape(-1, left.shape[2]))

    def __call__(self, changes: Array) -> Array:
        """Changes (windows, K, outputs, n) as columns (values, n) that nothing else explains."""
        seen = self._without_starts(changes)
        seen = np.concatenate([seen, np.zeros((self.priors, seen.shape[1]))])
        return np.asarray(seen - self.numbers @ (self.numbers.T @ seen)) if self.priors else seen

    def effect(self, added: Added, atoms: Sequence[Atom], changes: Array) -> Visible:
        """An effect with its columns, at the starting point of its shapes at which it shows as usual."""
        names = added.amplitudes or tuple(added.delays)
        columns = self(changes)
        columns = columns.reshape(len(columns), len(atoms), len(names))
        sizes = np.array([list(a.shape.values()) if added.delays else a.scale.tolist() for a in atoms])
        norms = np.sqrt(self.information) * np.linalg.norm(columns, axis=0)
        spans = tuple(orth(columns[:, k], 1e-9) for k in range(len(atoms)))
        if added.shares:
            shape = next(iter(added.shapes))
            strength = norms.max(axis=1)
            at = int(np.argmin(np.where(strength >= DISTANCE, strength, np.inf)))
            size = next(iter(atoms[at].shape.values())) if strength[at] >= DISTANCE else None
            return Visible(added, shape, size, None, columns[:, at, int(np.argmax(norms[at]))], spans)
        with np.errstate(divide="ignore"):
            least = sizes * DISTANCE / norms
        at = int(np.argsort(least.min(axis=1), kind="stable")[len(atoms) // 2])
        number = int(np.argmin(least[at]))
        name, size = names[number], float(least[at, number])
        plausible = added.scales[name]  # of a delay a sampling period, and its bound is the longest one
        shows = size <= (added.bounds[name][1] if name in added.delays else plausible)
        seen = (size, size / plausible) if shows else (None, None)
        return Visible(added, name, seen[0], seen[1], columns[:, at, number], spans)
