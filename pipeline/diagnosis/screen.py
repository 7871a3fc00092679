"""Which effects are worth a fit: a linear look at all of them, along the free runs of a fitted model.

A small amount of an effect changes the free-run errors of every window in proportion. Least squares of the
errors by these changes, base parameters and starts of the windows going along, says how far the loss would
fall: the score test of an output-error model. It takes one simulation a starting point and differentiates no
measurement, and it treats ports, actuators, sensors and effects with memory alike.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.choose import PARSIMONY
from pipeline.diagnosis.fitted import Fitted
from pipeline.diagnosis.hypothesis import Hypothesis
from pipeline.diagnosis.levels import levels
from pipeline.diagnosis.recording import Recording
from pipeline.diagnosis.tangent import Tangent
from pipeline.physics.effects.effect import Effect
from pipeline.physics.effects.library import effects
from pipeline.physics.effects.place import Place

Array = NDArray[np.float64]

#: Of its plausible size: how much of an effect is tried.
AMOUNT = 0.1
#: Starting points of an effect that are looked at, and that a fit is to start from; parts of the experiments.
POINTS, STARTS, FOLDS = 48, 3, 4


@dataclass(frozen=True, eq=False)
class Point:
    """One candidate at one starting point of its shapes.

    Attributes:
        effect, hypothesis: the candidate, and the model with it. values: of its shapes.
        names: of its amplitudes, or of a delay. size: (names,) what was tried, SI.
        slopes: (windows, names, most steps, outputs) change of the errors by that.
        bounds: (2, names) in units of `size`.
    """

    effect: Effect
    hypothesis: Hypothesis
    values: dict[str, float]
    names: tuple[str, ...]
    size: Array
    slopes: Array
    bounds: Array

    def start(self, base: dict[str, float], amounts: Array) -> dict[str, float]:
        """Values to start a fit from, of coefficients (names,) in units of `size`."""
        added = self.hypothesis.effects[-1]
        found = {**base, **self.values}
        for name, amount, size in zip(self.names, amounts, self.size, strict=True):
            if name in added.delays:
                found[name] = max(amount, 0.5) * size
            elif name not in added.shares:
                found[name] = amount * size
        return found


@dataclass(frozen=True, eq=False)
class Screened:
    """A candidate: the model with it, by how much the cross-validated loss falls, and values to start a fit
    from, the best first.
    """

    hypothesis: Hypothesis
    gain: float
    starts: tuple[dict[str, float], ...]


def screen(base: Fitted, recording: Recording, workers: int) -> list[Screened]:
    """All candidates on top of a fitted model, the most promising first.

    Args:
        base: the model. recording: some of the windows that it was fitted to.
        workers: threads.
    """
    look = _Look(base, recording)
    asked = [(e, p) for e in effects() for p in _free(base.hypothesis, e)]
    with ThreadPoolExecutor(workers) as pool:
        points = [point for found in pool.map(lambda one: list(look.points(*one)), asked) for point in found]
    return look.ranked(points)


def _free(base: Hypothesis, effect: Effect) -> Iterator[Place]:
    """Where it can be added: numbers of other effects have no effects of their own."""
    taken = {e.place.channel for e in base.effects if e.family == effect.family}
    known = set(effect.places(base.study.system))
    for place in effect.places(base.system):
        if place in known and place.channel not in taken:
            yield place


class _Look:
    """Candidates on top of a fitted model."""

    def __init__(self, base: Fitted, recording: Recording) -> None:
        self.base, self.recording = base, recording
        self.tangent = Tangent(base, recording)

    def points(self, effect: Effect, place: Place) -> Iterator[Point]:
        """One candidate at all its starting points."""
        hypothesis = self.base.hypothesis.plus(effect, place)
        added = hypothesis.effects[-1]
        names = added.amplitudes or tuple(added.delays)
        highest = {u.name: u.high for u in hypothesis.unknowns}
        within = [dict.fromkeys(min(v, highest[n]) for v in values) for n, values in added.shapes.items()]
        grid = [dict(zip(added.shapes, values, strict=True)) for values in product(*within)]
        chosen = [grid[k] for k in np.linspace(0, len(grid) - 1, min(POINTS, len(grid))).astype(int)]
        sizes = np.array([[self._amount(hypothesis, n, values) for n in names] for values in chosen])
        slopes = self.tangent.slopes(
            hypothesis,
            [
                {**values, n: size}
                for values, row in zip(chosen, sizes, strict=True)
                for n, size in zip(names, row, strict=True)
            ],
        )
        for k, (values, size) in enumerate(zip(chosen, sizes, strict=True)):
            bounds = np.array([(0.0, 1.0) if n in added.delays else added.bounds[n] for n in names]).T
            scaled = bounds if added.delays else bounds / size
            which = slice(k * len(names), (k + 1) * len(names))
            yield Point(effect, hypothesis, values, names, size, slopes[:, which], scaled)

    def _amount(self, hypothesis: Hypothesis, name: str, values: dict[str, float]) -> float:
        added = hypothesis.effects[-1]
        if name in added.delays:
            return values[name]
        return 1.0 if name in added.shares else AMOUNT * added.scales[name]

    def ranked(self, points: Sequence[Point]) -> list[Screened]:
        """Candidates with their best starting points, in all experiments or at one level."""
        first = self.tangent.shared
        products = self.tangent.products([p.slopes for p in points], [p.bounds for p in points])
        at = first + np.cumsum([0, *(len(p.names) for p in points)])
        shared = list(range(first))
        without = products.selected(shared, ()).gain(FOLDS)
        found: dict[tuple[Effect, Place], list[tuple[float, Point, Array]]] = {}
        for k, point in enumerate(points):
            own = list(range(at[k], at[k + 1]))
            for place, members in self._places(point):
                part = products.selected(shared, own, members)
                if point.hypothesis.effects[-1].per_experiment:
                    gain, amounts = part.split(first).solved()[1], np.zeros(len(own))
                    gain -= products.selected(shared, ()).solved()[1]
                else:
                    gain, amounts = part.gain(FOLDS) - without, part.solved()[0][first:]
                found.setdefault((point.effect, place), []).append((gain, point, amounts))
        ranked = [self._screened(place, tries) for (_, place), tries in found.items()]
        price = PARSIMONY * int(self.recording.steps.sum()) * self.tangent.r.shape[2]
        return sorted(ranked, key=lambda s: price * s.hypothesis.complexity - s.gain)

    def _places(self, point: Point) -> Iterator[tuple[Place, NDArray[np.int64] | None]]:
        place = point.hypothesis.effects[-1].place
        yield place, None
        if place.kind == "port":
            experiments = self.base.hypothesis.study.logs.experiments
            for factor, level, members in levels(experiments.iloc[np.unique(self.recording.owner)]):
                yield Place("port", place.name, factor, level), members

    def _screened(self, place: Place, tries: list[tuple[float, Point, Array]]) -> Screened:
        best = sorted(tries, key=lambda one: -one[0])[:STARTS]
        point = best[0][1]
        hypothesis = point.hypothesis
        if place != hypothesis.effects[-1].place:
            hypothesis = self.base.hypothesis.plus(point.effect, place)
        base = dict(self.base.fit.values)
        starts = [p.start(base, amounts) for _, p, amounts in best]
        if hypothesis.effects[-1].memory:
            # what remembers is hardly in proportion to a small amount of it
            starts += [p.start(base, np.ones(len(amounts)) / AMOUNT) for _, p, amounts in best]
        return Screened(hypothesis, best[0][0], tuple(starts))
