"""Simulations up to an event and beyond, in plain numpy: the reference of the compiled event times.

Method of Runge and Kutta of order four with a fixed step. Where the expression of the event falls through
zero in a step, the parabola through its values at the start, the middle and the end of the step says when.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from unmodelled.base.errors import BadInput, closest
from unmodelled.systems.functions import sanitised
from unmodelled.systems.model import Event, System
from unmodelled.systems.numeric import numpy_system_function

Array = NDArray[np.float64]
Rates = Callable[[Array | float, Array], Array]  # (t, x) -> x'


@dataclass(frozen=True)
class Experiments:
    """L experiments on one clock, as simulations need them.

    Attributes:
        u: (L, T, inputs) every `period` s, straight lines in between. c: (L, constants). x0: (L, states) at
            t = 0.

    Raises:
        BadInput: when a number is not finite, or the period not positive.
        ValueError: when the shapes do not belong together.
    """

    u: Array
    period: float
    c: Array
    x0: Array

    def __post_init__(self) -> None:
        if not (self.u.ndim == 3 and self.c.ndim == self.x0.ndim == 2):
            raise ValueError(f"u, c, x0 of shapes {self.u.shape}, {self.c.shape}, {self.x0.shape}")
        if not len(self.u) == len(self.c) == len(self.x0):
            raise ValueError(f"{len(self.u)} inputs, {len(self.c)} constants and {len(self.x0)} starts")
        for name, values in (("input", self.u), ("operating point", self.c), ("start", self.x0)):
            for i in np.flatnonzero(~np.isfinite(values).reshape(len(values), -1).all(axis=1))[:1]:
                raise BadInput(f"experiment {i + 1}: the {name} has a value that is not finite")
        if not 0.0 < self.period < np.inf:
            raise BadInput(f"period must be a positive number of seconds, got {self.period}")

    def __len__(self) -> int:
        return len(self.u)

    def only(self, members: Sequence[int] | NDArray[np.int64]) -> Experiments:
        """Some of the experiments."""
        return replace(self, u=self.u[members], c=self.c[members], x0=self.x0[members])

    def input(self, t: Array | float) -> Array:
        """Inputs (..., L, inputs) at `t`, a number or (..., L), s; held beyond the ends."""
        last = self.u.shape[1] - 1
        place = np.clip(np.asarray(t) / self.period, 0.0, last)
        k = np.minimum(place.astype(np.int64), max(0, last - 1))
        row = np.arange(len(self))
        now, then = self.u[row, k], self.u[row, np.minimum(k + 1, last)]
        return np.asarray(now + (place - k)[..., None] * (then - now))

    def steps(self, step: float) -> int:
        """Number of steps of `step` s within the logs.

        Raises:
            BadInput: when `step` is no multiple of the period.
        """
        periods = round(step / self.period) if 0.0 < step < np.inf else 0
        if periods < 1 or abs(periods * self.period - step) > 1e-6 * self.period:
            raise BadInput(f"step must be a multiple of the period {self.period:g} s, got {step}")
        return int((self.u.shape[1] - 1) // periods)


@dataclass(frozen=True)
class Trajectories:
    """t (K,) s, x (S, L, K, states), time (S, L) s of the event, nan where it does not happen."""

    t: Array
    x: Array
    time: Array


def event_named(system: System, name: str) -> Event:
    """The event `name` of `system`.

    Raises:
        BadInput: when there is none.
    """
    events = {e.name: e for e in system.events}
    if name not in events:
        hint = closest(name, events) if events else ""
        raise BadInput(f"system {system.name}: has no event {name!r}{hint}")
    return events[name]


def scaled_parameters(system: System, uncertain: Sequence[str], theta: Array) -> Array:
    """Values (S, parameters) where those of `uncertain` are `theta` (S, n) times the nominal ones.

    Raises:
        BadInput: when a name is unknown or named twice, or the value is zero.
        ValueError: when theta has another shape.
    """
    values = np.array(system.values)
    index = uncertain_indices(system, uncertain)
    theta = np.asarray(theta, np.float64)
    if theta.ndim != 2 or theta.shape[1] != len(index):
        raise ValueError(f"theta must be (samples, {len(index)}), got {theta.shape}")
    p = np.tile(values, (len(theta), 1))
    p[:, index] = theta * values[index]
    return p


def uncertain_indices(system: System, uncertain: Sequence[str]) -> list[int]:
    """Which parameters `uncertain` names; see `scaled_parameters` for what is raised."""
    names = [p.name for p in system.parameters]
    for k, name in enumerate(uncertain):
        if name not in names:
            hint = closest(name, names) if names else ""
            raise BadInput(f"system {system.name}: has no parameter {name!r}{hint}")
        if name in uncertain[:k]:
            raise BadInput(f"system {system.name}: parameter {name!r} is named twice")
        if system.values[names.index(name)] == 0.0:
            raise BadInput(
                f"system {system.name}: parameter {name!r} is zero, and so is every multiple of it"
            )
    return [names.index(name) for name in uncertain]


def event_times(
    system: System, event: str, uncertain: Sequence[str], theta: Array, runs: Experiments, step: float
) -> Array:
    """Times (S, L), s, of the first fall through zero; nan where it does not happen within the log.

    Args:
        theta: (S, n) multiples of the nominal values of `uncertain`. step: s, a multiple of the period.

    Raises:
        BadInput: see `scaled_parameters`, `event_named` and `Experiments.steps`.
    """
    moment = replace(event_named(system, event), then=None)
    for _, _, time in _march(system, moment, scaled_parameters(system, uncertain, theta), runs, step):
        if np.isfinite(time).all():
            break
    return time


def trajectories(
    system: System, event: str, uncertain: Sequence[str], theta: Array, runs: Experiments, step: float
) -> Trajectories:
    """Both phases: the system up to the event, and with the dynamics that it has from there on.

    Arguments and errors are those of `event_times`.
    """
    p = scaled_parameters(system, uncertain, theta)
    path = [(t, x, time) for t, x, time in _march(system, event_named(system, event), p, runs, step)]
    return Trajectories(np.array([t for t, _, _ in path]), np.stack([x for _, x, _ in path], 2), path[-1][2])


def _march(
    system: System, event: Event, p: Array, runs: Experiments, step: float
) -> Iterator[tuple[float, Array, Array]]:
    """t, x (S, L, states) and the times (S, L) of the events so far, step by step."""
    before = _function(system, system.closed, p, runs)
    after = before
    if event.then is not None:
        after = _function(system, replace(system, dynamics=event.then).closed, p, runs)
    crossing = _function(system, (sanitised(event.expression),), p, runs)
    x = np.broadcast_to(runs.x0, (len(p), *runs.x0.shape)).copy()
    time = np.full(x.shape[:2], np.nan)
    yield 0.0, x, time
    start = crossing(0.0, x)[..., 0]
    for k in range(runs.steps(step)):
        t = k * step
        with np.errstate(all="ignore"):
            now = Step.of(_joined(before, after, np.isfinite(time)), t, x, step)
            x = now.at(1.0)
            end = crossing(t + step, x)[..., 0]
            falls = np.isnan(time) & (start > 0.0) & (end <= 0.0)
            if falls.any():
                middle = crossing(t + 0.5 * step, now.at(0.5))[..., 0]
                share = np.where(falls, _root(start, middle, end), 1.0)
                time = np.where(falls, t + share * step, time)
                if event.then is not None:
                    moment, rest = t + share * step, (1.0 - share) * step
                    late = Step.of(after, moment, now.at(share[..., None]), rest).at(1.0)
                    x = np.where(falls[..., None], late, x)
                    end = crossing(t + step, x)[..., 0]
        start = end
        yield t + step, x, time


def _function(system: System, expressions: Sequence[sp.Expr], p: Array, runs: Experiments) -> Rates:
    function = numpy_system_function(system, expressions, efforts_zero=True)
    return lambda t, x: function(t, x, runs.input(t), None, p[:, None], runs.c)


def _joined(before: Rates, after: Rates, happened: NDArray[np.bool_]) -> Rates:
    """The rates of either phase, by run."""
    if before is after or not happened.any():
        return before
    if happened.all():
        return after
    return lambda t, x: np.where(happened[..., None], after(t, x), before(t, x))


def _root(start: Array, middle: Array, end: Array) -> Array:
    """Where, as a share of the step, the parabola through the three values falls through zero."""
    bend = 2.0 * (start - 2.0 * middle + end)
    slope = 4.0 * middle - 3.0 * start - end
    return np.asarray(2.0 * start / (np.sqrt(np.maximum(0.0, slope**2 - 4.0 * bend * start)) - slope))


@dataclass(frozen=True)
class Step:
    """One step from `x` and its four stages times its length."""

    x: Array
    stages: tuple[Array, Array, Array, Array]

    @classmethod
    def of(cls, rates: Rates, t: Array | float, x: Array, step: Array | float) -> Step:
        """A step of length `step`, a number or one for every run."""
        h = np.asarray(step)[..., None]
        k1 = h * rates(t, x)
        k2 = h * rates(t + 0.5 * step, x + 0.5 * k1)
        k3 = h * rates(t + 0.5 * step, x + 0.5 * k2)
        return cls(x, (k1, k2, k3, h * rates(t + step, x + k3)))

    def at(self, share: Array | float) -> Array:
        """The state after `share` of the step: to fourth order at the end, to third in between."""
        k1, k2, k3, k4 = self.stages
        square, cube = share * share, 2.0 / 3.0 * share**3
        first, last = share - 1.5 * square + cube, cube - 0.5 * square
        return np.asarray(self.x + first * k1 + (square - cube) * (k2 + k3) + last * k4)
