"""Value of experiments: the distance of models, or the intervals of numbers after the experiment.

Beside it, the further sensor that would help a designed experiment most to tell models apart.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import sympy as sp
from scipy.special import log_ndtr, logsumexp, ndtr, ndtri_exp

from unmodelled.base.arrays import Array
from unmodelled.design.limits import MARGIN, Limits
from unmodelled.design.rivals import Rival
from unmodelled.design.runs import Simulated, in_parts
from unmodelled.systems.model import System, symbol
from unmodelled.systems.units import describe, parse_unit

#: What counts as a gain: of the probability that models are told apart, or of the width of an interval.
GAIN = 0.01
#: Prediction, in standard deviations of an output's noise, beyond which a simulation has diverged.
DIVERGED = 1e12


@dataclass(frozen=True, eq=False)
class Value:
    """Value of simulated experiments, or of one experiment with several numbers of the models."""

    excess: Array  # (designs,), largest excess of a travel limit, as a share of its width; inf: diverges
    #: (designs, alternatives), from the named model, standard deviations; nan beyond the limits.
    distances: Array
    #: (designs, numbers), standard deviations of the named model's numbers, SI; nan beyond limits.
    after: Array

    @property
    def odds(self) -> Array:
        """Return the probability (designs, alternatives) that the named model is told from each."""
        return odds(self.distances)

    @property
    def distance(self) -> Array:
        """Return the distance (alternatives,) whose odds are the mean of the odds, standard deviations."""
        misses = logsumexp(log_ndtr(-0.5 * self.distances), axis=0) - np.log(len(self.distances))
        return np.asarray(-2.0 * ndtri_exp(misses))


def odds(distances: Array) -> Array:
    """Return the probability (..., alternatives) of telling models at distances in standard deviations."""
    return np.asarray(ndtr(0.5 * distances))


@dataclass(frozen=True, eq=False)
class Criterion:
    """Criterion of an experiment.

    The distance of two models is the T-criterion (Atkinson and Fedorov 1975): the weighted squared gap of
    their outputs, minimised over the numbers of both within their uncertainty. With one model, the numbers'
    covariance after the experiment counts (A-optimality). An output's weight is 1/(noise² + samples spread²):
    noise differs from sample to sample; what experiments of one machine differ by may last a whole run, and
    does not average out.

    A search looks at the fitted numbers. What an experiment is chosen for, and what it promises, is the mean
    over numbers drawn from their intervals, for all of which it must keep the limits.
    """

    rivals: Sequence[Rival]  # the named model, then its alternatives
    limits: Limits
    noise: Array  # (outputs,), standard deviations of the sensor noise, in units of the outputs
    spread: Array  # (outputs,), error of the named model over whole runs beyond the noise, in these units
    numbers: Sequence[str]  # those whose relative intervals count if there are no alternatives

    def __call__(self, u: Array) -> Value:
        """Simulate experiments (designs, samples, inputs), SI, and compute their value at the fitted numbers.

        Beyond the limits are also those that leave them at numbers from the intervals.
        """
        excess = self._excess(u, False)
        inside = np.flatnonzero(excess == 0.0)
        excess[inside] = self._excess(u[inside], True)
        inside = np.flatnonzero(excess == 0.0)
        named = self.rivals[0]
        distances = np.full((len(u), len(self.rivals) - 1), np.nan)
        after = np.full((len(u), len(named.values)), np.nan)
        if len(inside):
            y, slopes = self._outputs(named, u[inside], *named.sets)
            deviation = named.root @ _root_after(slopes)
            after[inside] = np.linalg.norm(deviation, axis=-1)
            for k, other in enumerate(self.rivals[1:]):
                distances[inside, k] = distance((y, slopes), self._outputs(other, u[inside], *other.sets))
        return Value(excess, distances, after)

    def promise(self, u: Array) -> Value:
        """Compute the value of one experiment (samples, inputs), SI, for every draw of the models' numbers.

        A draw takes the place of a design. The machine is the named model with the numbers of the draw; only
        the alternatives' numbers may move towards it.
        """
        named, u = self.rivals[0], u[None]
        excess = np.max([each[0] for each in self._excesses(u, True)], axis=0)
        excess = np.maximum(excess, self._excess(u, False))
        runs = [self._outputs(named, u, *each) for each in named.around_draws]
        y, slopes = (np.concatenate([each[k] for each in runs]) for k in range(2))
        after = np.linalg.norm(named.root @ _root_after(slopes), axis=-1)
        distances = np.full((len(y), len(self.rivals) - 1), np.nan)
        for k, other in enumerate(self.rivals[1:]):
            seen = [np.repeat(each, len(y), axis=0) for each in self._outputs(other, u, *other.sets)]
            distances[:, k] = distance((y, slopes[:, :0]), (seen[0], seen[1]))
        return Value(excess, distances, after)

    def worth(self, u: Array) -> float:
        """Return what the best experiments (samples, inputs), SI, are compared by, see `scores`."""
        found = self.promise(u)
        after = found.after.mean(axis=0, keepdims=True)
        mean = Value(found.excess.max(keepdims=True), found.distance[None], after)
        return float(self.scores(mean)[0])

    def runs(self, u: Array) -> Iterator[Simulated]:
        """Yield the runs of an experiment (samples, inputs), SI, by model: fitted numbers, then the draws."""
        for rival in self.rivals:
            yield rival.runs(u[None], self.limits, [rival.sets[0][0], *rival.drawn]).of(0)

    def _excess(self, u: Array, drawn: bool) -> Array:
        """Largest excess (designs,) of experiments, at the fitted numbers or at all draws."""
        largest = np.zeros(len(u))
        for each in self._excesses(u, drawn):
            largest = np.maximum(largest, each.max(axis=1))
        return largest

    def _excesses(self, u: Array, drawn: bool) -> Iterator[Array]:
        """Excess (designs, sets) by model."""
        for rival in self.rivals:
            systems = rival.drawn if drawn else rival.sets[0][:1]
            found: list[Array] = [np.empty((0, len(systems)))]
            for part in in_parts(u, systems, self.limits, rival.substeps(self.limits)):
                _, watched, step = rival.runs(part, self.limits, systems)
                each = self.limits.excess(np.concatenate(watched), step, MARGIN)
                found.append(each.reshape(watched.shape[:2]))
            yield np.concatenate(found)

    def scores(self, found: Value) -> Array:
        """Return what a search maximises (designs,): positive within the limits, below -1 beyond them."""
        beyond = -1.0 - np.minimum(found.excess, 1e6)
        if len(self.rivals) > 1:
            # ties of models that no experiment within the limits tells apart are left to the others
            value = found.distances.min(axis=1) + 1e-3 * found.distances.mean(axis=1)
        else:
            before, after = (self.relative(s) for s in (self.before[None], found.after))
            value = np.log(before / after)
        return np.asarray(np.where(found.excess > 0.0, beyond, value))

    def gains(self, found: Value, other: Value) -> bool:
        """Return whether an experiment promises more in the mean than another one, both within the limits.

        It tells an alternative with `GAIN` more, or narrows a counted interval by this share.
        """
        if len(self.rivals) > 1:
            return bool((found.odds.mean(axis=0) - other.odds.mean(axis=0)).max() > GAIN)
        after, beside = (value.after.mean(axis=0)[self._counted] for value in (found, other))
        return bool((after < (1.0 - GAIN) * beside).any())

    @property
    def before(self) -> Array:
        """Return the standard deviations of the named model's numbers from the logs, shape (numbers,), SI."""
        return np.asarray(np.linalg.norm(self.rivals[0].root, axis=1))

    def relative(self, deviation: Array) -> Array:
        """Return the rms (designs,) of relative standard deviations (designs, numbers) of counted numbers."""
        named, rows = self.rivals[0], self._counted
        scales = [named.fitted.hypothesis.unknowns[k].scale for k in rows]
        size = np.array([abs(named.values[n]) or s for n, s in zip(self.numbers, scales, strict=True)])
        return np.asarray(np.sqrt(np.mean((deviation[:, rows] / size) ** 2, axis=1)))

    @property
    def _counted(self) -> list[int]:
        return [list(self.rivals[0].values).index(name) for name in self.numbers]

    @property
    def unit(self) -> Array:
        """Return the standard deviation of the outputs, shape (outputs,), that an experiment is judged by."""
        return np.sqrt(self.noise**2 + self.limits.samples * self.spread**2)

    def _outputs(
        self, rival: Rival, u: Array, systems: Sequence[System], steps: Array
    ) -> tuple[Array, Array]:
        return weighted(rival.runs(u, self.limits, systems, ()).y / self.unit, steps)


def weighted(y: Array, steps: Array) -> tuple[Array, Array]:
    """Return predictions (designs, values) and their slopes (designs, numbers, values) by the numbers.

    Takes y (designs, sets, samples, outputs), of which values beyond `DIVERGED` say nothing, and steps
    (numbers,), see `Rival.around`.
    """
    flat = y.reshape(*y.shape[:2], -1)
    flat = np.where(np.abs(flat) < DIVERGED, flat, 0.0)
    return flat[:, 0], (flat[:, 1:] - flat[:, :1]) * steps[:, None]


def _root_after(slopes: Array) -> Array:
    """Roots (designs, n, n) of the covariance (1 + S S^T)^-1 of scaled numbers; slopes S (designs, n,
    values).
    """
    information = np.eye(slopes.shape[1]) + slopes @ slopes.swapaxes(1, 2)
    eigenvalues, vectors = np.linalg.eigh(information)
    return np.asarray(vectors / np.sqrt(eigenvalues)[:, None, :])


def distance(one: tuple[Array, Array], other: tuple[Array, Array]) -> Array:
    """Return the distance (designs,) of two models whose numbers may still move, in standard deviations.

    Of each model it takes the predictions (designs, values) and their slopes, see `weighted`.
    """
    gap, slopes = one[0] - other[0], np.concatenate([one[1], -other[1]], axis=1)
    root = _root_after(slopes)
    moved = np.einsum("dnk,dn->dk", root, np.einsum("dnv,dv->dn", slopes, gap))
    return np.asarray(np.sqrt(np.maximum(np.sum(gap**2, axis=1) - np.sum(moved**2, axis=1), 0.0)))


@dataclass(frozen=True)
class Sensor:
    """A sensor that a machine does not have yet."""

    label: str  # such as "v" or "the effort f at rail"
    unit: str  # SI
    of: Callable[[System], sp.Expr]  # the sensed quantity of a model


@dataclass(frozen=True, eq=False)
class BestSensor:
    """The sensor that separates the alternatives best in an experiment."""

    sensor: Sensor
    accuracy: float  # assumed error, as a share of the quantity's standard deviation in the experiment
    distances: Array  # (alternatives,) with this sensor, standard deviations


def sensors(system: System) -> Iterator[Sensor]:
    """Yield the states, their rates and the efforts of ports that no output shows."""
    outputs = {output.expression for output in system.outputs}
    for state, x, rate in zip(system.states, system.x, system.dynamics, strict=True):
        if x not in outputs:
            yield Sensor(state.name, state.unit, partial(_state, state.name))
        if rate not in {*system.x, *outputs}:
            unit = describe(parse_unit(f"({state.unit})/s").dimension)
            yield Sensor(f"d({state.name})/dt", unit, partial(_rate, state.name))
    for port in system.ports:
        yield Sensor(f"the effort {port.effort} at {port.name}", port.unit, partial(_effort, port.name))


def _state(name: str, system: System) -> sp.Expr:
    return symbol(name)


def _rate(name: str, system: System) -> sp.Expr:
    rate = system.closed[[state.name for state in system.states].index(name)]
    return rate.xreplace(dict.fromkeys(system.e, sp.S.Zero))


def _effort(name: str, system: System) -> sp.Expr:
    law = system.port(name).law
    return sp.S.Zero if law is None else law


def best_sensor(criterion: Criterion, system: System, u: Array) -> BestSensor | None:
    """Return the sensor with which an experiment u (samples, inputs), SI, separates the alternatives best.

    Noise of the sensor and error of the named model in its quantity are assumed to be the same shares of the
    quantity's standard deviation in the experiment as those of the present outputs (medians).
    """
    known = list(sensors(system))
    if len(criterion.rivals) < 2 or not known:
        return None
    models = [rival.sets[0][0] for rival in criterion.rivals]
    runs = [
        rival.runs(u[None], criterion.limits, rival.sets[0], [sensor.of(model) for sensor in known])
        for rival, model in zip(criterion.rivals, models, strict=True)
    ]
    size = runs[0].y[0, 0].std(axis=0)
    seen = size > 0.0
    if not seen.any():
        return None
    noise, spread = (float(np.median(e[seen] / size[seen])) for e in (criterion.noise, criterion.spread))
    share = np.hypot(noise, np.sqrt(criterion.limits.samples) * spread)
    found = []
    for k, sensor in enumerate(known):
        unit = share * max(float(run.watched[0, 0, :, k].std()) for run in runs)
        if not 0.0 < unit < np.inf:
            continue
        named, *others = (
            weighted(np.concatenate([y / criterion.unit, w[..., k : k + 1] / unit], axis=-1), rival.sets[1])
            for rival, (y, w, _) in zip(criterion.rivals, runs, strict=True)
        )
        distances = np.array([distance(named, other)[0] for other in others])
        found.append(BestSensor(sensor, float(np.hypot(noise, spread)), distances))
    return max(found, key=lambda one: float(one.distances.min()), default=None)
