"""Screening of effects: a linear score test of all candidates along the free runs of a fitted model.

A small amount of an effect changes the free-run errors of every window in proportion. Least squares of the
errors on these changes, with uncertain parameters and initial states as further regressors, predicts how far
the loss would fall (score test of an output-error model). It takes one simulation per starting point, does
not differentiate measurements, and treats ports, actuators, sensors and effects with memory alike.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np
from numpy.typing import NDArray

from unmodelled.base.workers import threads_of
from unmodelled.diagnosis.data.levels import levels
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.fitting.unknowns import Start
from unmodelled.diagnosis.search.least_squares import Products
from unmodelled.diagnosis.search.tangent import Tangent
from unmodelled.effects.added import Added
from unmodelled.effects.effect import Effect
from unmodelled.effects.library import effects
from unmodelled.effects.place import Place

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

#: Amount of an effect that is tried, as a share of its plausible size: small enough to be linear.
SCREENED_AMOUNT = 0.1
#: Starting points of an effect that are screened, and that a fit starts from (budgets); folds of the
#: cross-validation over experiments.
SCREENED_POINTS, FITTED_POINTS, SCREEN_FOLDS = 48, 3, 4


@dataclass(frozen=True, eq=False)
class Point:
    """A candidate at one starting point of its shapes.

    Attributes:
        values: values of its shapes, by name, SI.
        names: names of its amplitudes, or of a delay.
        size: amounts that were tried, shape (names,), SI.
        products: products of the base's unknowns and of `names`, in units of `size`.
    """

    values: dict[str, float]
    names: tuple[str, ...]
    size: Array
    products: Products

    def start(self, added: Added, amounts: Array) -> dict[str, float]:
        """Return values to start a fit from, by name, SI.

        Args:
            added: effect of the candidate.
            amounts: coefficients in units of `size`, shape (names,).
        """
        found = dict(self.values)
        for name, amount, size in zip(self.names, amounts.tolist(), self.size.tolist(), strict=True):
            if name in added.delays:
                found[name] = max(amount, 0.5) * size
            elif name not in added.shares:
                found[name] = amount * size
        return found


@dataclass(frozen=True, eq=False)
class Screened:
    """A screened candidate: a fitted hypothesis and one effect more.

    Attributes:
        base: fitted hypothesis.
        effect: effect that is added.
        place: place of the effect.
        gain: predicted fall of the cross-validated loss.
        tries: starting points, the best first, with coefficients of shape (names,).
        is_own: whether the effect has a number of its own in every experiment, default False.
        built: the hypothesis with the effect, where the screen built it; default None.
    """

    base: FittedHypothesis
    effect: Effect
    place: Place
    gain: float
    tries: tuple[tuple[Point, Array], ...]
    is_own: bool = False
    built: Hypothesis | None = None

    @cached_property
    def hypothesis(self) -> Hypothesis:
        """Return the hypothesis with the effect."""
        return self.built or self.base.hypothesis.plus(self.effect, self.place)

    @property
    def key(self) -> frozenset[tuple[str, str, Place]]:
        """Return the key of `hypothesis`."""
        return self.base.hypothesis.key | {(self.effect.family, self.effect.variant, self.place)}

    @property
    def is_delay(self) -> bool:
        """Return whether the effect is a delay of an input or output."""
        return bool(self.hypothesis.effects[-1].delays)

    @property
    def is_late(self) -> bool:
        """Return whether the effect is a delay, or has a memory."""
        return self.is_delay or bool(self.hypothesis.effects[-1].memory)

    @property
    def starts(self) -> tuple[Start, ...]:
        """Return values to start a fit from, the best first."""
        added, base = self.hypothesis.effects[-1], self.base.fit.every
        found: list[Start] = [{**base, **point.start(added, amounts)} for point, amounts in self.tries]
        if added.memory:
            # what remembers is hardly in proportion to a small amount of it
            more = [
                point.start(added, np.ones(len(amounts)) / SCREENED_AMOUNT) for point, amounts in self.tries
            ]
            found += [{**base, **start} for start in more]
        return tuple(found)


def screen(base: FittedHypothesis, recording: Recording, workers: int) -> list[Screened]:
    """Screen all candidates with one effect more, the most promising first.

    Args:
        base: fitted hypothesis that effects are added to.
        recording: some of the windows that it was fitted to.
        workers: number of threads.
    """
    look = _Look(base, recording)
    asked = [(e, p) for e in effects() for p in _free(base.hypothesis, e)]
    with threads_of(workers) as pool:
        found = [one for several in pool.map(lambda one: list(look.screened(*one)), asked) for one in several]
    return sorted(found, key=lambda one: -one.gain)


def _free(base: Hypothesis, effect: Effect) -> Iterator[Place]:
    """Places where an effect can be added; numbers of other effects are none."""
    taken = {e.place.channel for e in base.effects if e.family == effect.family}
    known = set(effect.places(base.study.system))
    if not known:
        return
    asked = {e.place for e in base.effects if e.family in effect.beside} if effect.beside else known
    for place in effect.places(base.system):
        if place in known & asked and place.channel not in taken:
            yield place


class _Look:
    """Candidates on top of a fitted model."""

    def __init__(self, base: FittedHypothesis, recording: Recording) -> None:
        self.base, self.tangent = base, Tangent(base, recording)
        study = base.hypothesis.study
        self.levels = list(levels(study.logs.experiments.iloc[np.unique(recording.owner)], study.thresholds))
        alone = self.tangent.columns.alone
        self.without, self.without_in_sample = alone.gain(SCREEN_FOLDS), alone.solved()[1]

    def screened(self, effect: Effect, place: Place) -> Iterator[Screened]:
        """A candidate in all experiments and at every level."""
        if effect.at_levels and not self.levels:
            return
        hypothesis = self.base.hypothesis.plus(effect, place)
        points = list(self._points(hypothesis))
        if hypothesis.effects[-1].per_experiment:
            (point,) = points
            gain = point.products.split(self.tangent.shared).solved()[1] - self.without_in_sample
            tries = ((point, np.zeros(len(point.names))),)
            yield Screened(self.base, effect, place, gain, tries, True, hypothesis)
            return
        if not effect.at_levels:
            yield replace(self._screened(effect, place, points, None), built=hypothesis)
        for factor, level, members in self.levels if effect.at_levels or place.kind == "port" else ():
            local = replace(place, factor=factor, level=level)
            yield self._screened(effect, local, points, members)

    def _screened(
        self, effect: Effect, place: Place, points: Sequence[Point], members: Indices | None
    ) -> Screened:
        parts = [point.products.only(self.tangent.shared, members) for point in points]
        solved = [part.solved() for part in parts]
        best = sorted(range(len(points)), key=lambda k: -solved[k][1])[:FITTED_POINTS]
        tries = tuple((points[k], solved[k][0][self.tangent.shared :]) for k in best)
        return Screened(self.base, effect, place, parts[best[0]].gain(SCREEN_FOLDS) - self.without, tries)

    def _points(self, hypothesis: Hypothesis) -> Iterator[Point]:
        """The last effect at all its starting points."""
        added = hypothesis.effects[-1]
        names, chosen, sizes = tried(hypothesis, SCREENED_POINTS)
        sets = sets_of(names, chosen, sizes)
        slopes = self.tangent.slopes(hypothesis, sets)
        bounds = np.array([(0.0, 1.0) if n in added.delays else added.bounds[n] for n in names]).T
        own = slopes.reshape(len(slopes), *sizes.shape, *slopes.shape[2:])
        limits = bounds[:, None] / (1.0 if added.delays else sizes)
        found = self.tangent.products(own, np.broadcast_to(limits, (2, *sizes.shape)))
        yield from (Point(v, names, size, p) for v, size, p in zip(chosen, sizes, found, strict=True))


def tried(hypothesis: Hypothesis, most: int) -> tuple[tuple[str, ...], list[dict[str, float]], Array]:
    """Return what is tried of the last effect of a hypothesis.

    Args:
        hypothesis: hypothesis with an effect.
        most: largest number of starting points.

    Returns:
        Names of the effect's amplitudes, or of a delay; starting points of its shapes by name, SI; amounts
        that are tried, shape (points, names), SI.
    """
    added = hypothesis.effects[-1]
    names = added.amplitudes or tuple(added.delays)
    highest = {u.name: u.high for u in hypothesis.unknowns}
    within = [dict.fromkeys(min(v, highest[n]) for v in values) for n, values in added.shapes.items()]
    grid = [dict(zip(added.shapes, values, strict=True)) for values in product(*within)]
    chosen = [grid[k] for k in np.linspace(0, len(grid) - 1, min(most, len(grid))).astype(int)]
    return names, chosen, np.array([[_amount(added, n, values) for n in names] for values in chosen])


def sets_of(names: Sequence[str], chosen: Sequence[dict[str, float]], sizes: Array) -> list[dict[str, float]]:
    """Return a set of values for every amount at every starting point, the amounts of a point together.

    Args:
        names: names of the amounts.
        chosen: starting points by name, SI.
        sizes: amounts, shape (points, names), SI.
    """
    return [
        {**values, n: size}
        for values, row in zip(chosen, sizes.tolist(), strict=True)
        for n, size in zip(names, row, strict=True)
    ]


def _amount(added: Added, name: str, values: dict[str, float]) -> float:
    if name in added.delays:
        return values[name]
    return 1.0 if name in added.shares else SCREENED_AMOUNT * added.scales[name]
