"""Simulations to an event and beyond in plain NumPy: the reference for the compiled event times.

Runge-Kutta method of order four with a fixed step. If the expression of the event falls through zero within a
step, the parabola through its values at the start, the middle and the end of the step gives the time.
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
    """Experiments on one clock: inputs, operating points and initial states.

    Attributes:
        u: inputs of shape (L, T, inputs), sampled every `period`, linear in between.
        period: sampling period in s.
        c: constants of the operating point, shape (L, constants).
        x0: states at t = 0, shape (L, states).

    Raises:
        BadInput: if a number is not finite, or if the period is not positive.
        ValueError: if the shapes do not match.

    Examples:
        >>> runs = Experiments(np.zeros((2, 5, 1)), 0.1, np.zeros((2, 0)), np.ones((2, 2)))
        >>> len(runs), runs.steps(0.2)
        (2, 2)
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
                raise BadInput(
                    f"experiment {i + 1}: the {name} has a value that is not finite: correct its log"
                )
        if not 0.0 < self.period < np.inf:
            raise BadInput(f"period must be a positive number of seconds, got {self.period}")

    def __len__(self) -> int:
        return len(self.u)

    def only(self, members: Sequence[int] | NDArray[np.int64]) -> Experiments:
        """Return some of the experiments.

        Args:
            members: indices of the experiments, shape (K,).

        Returns:
            K experiments, in the order of `members`.
        """
        return replace(self, u=self.u[members], c=self.c[members], x0=self.x0[members])

    def input(self, t: Array | float) -> Array:
        """Return the inputs at given times, interpolated linearly and held beyond the ends.

        Args:
            t: times in s, a scalar or an array of shape (..., L).

        Returns:
            Inputs of shape (..., L, inputs).

        Examples:
            >>> runs = Experiments(np.array([[[0.0], [1.0]]]), 0.1, np.zeros((1, 0)), np.zeros((1, 1)))
            >>> runs.input(0.05).tolist()
            [[0.5]]
        """
        last = self.u.shape[1] - 1
        place = np.clip(np.asarray(t) / self.period, 0.0, last)
        k = np.minimum(place.astype(np.int64), max(0, last - 1))
        row = np.arange(len(self))
        now, then = self.u[row, k], self.u[row, np.minimum(k + 1, last)]
        return np.asarray(now + (place - k)[..., None] * (then - now))

    def steps(self, step: float) -> int:
        """Return the number of integration steps that fit into the logs.

        Args:
            step: integration step in s, a multiple of the sampling period.

        Returns:
            Number of steps.

        Raises:
            BadInput: if `step` is not a multiple of the sampling period.
        """
        periods = round(step / self.period) if 0.0 < step < np.inf else 0
        if periods < 1 or abs(periods * self.period - step) > 1e-6 * self.period:
            raise BadInput(f"step must be a multiple of the period {self.period:g} s, got {step}")
        return int((self.u.shape[1] - 1) // periods)


@dataclass(frozen=True)
class Trajectories:
    """Simulated states and event times of S parameter samples and L experiments.

    Attributes:
        t: time in s, shape (K,).
        x: states of shape (S, L, K, states).
        time: event times in s, shape (S, L); nan if the event does not happen.
    """

    t: Array
    x: Array
    time: Array


def event_named(system: System, name: str) -> Event:
    """Return an event of a system by its name.

    Args:
        system: system to look in.
        name: name of the event in the system file.

    Returns:
        The event.

    Raises:
        BadInput: if the system has no such event; the message suggests a name.
    """
    events = {e.name: e for e in system.events}
    if name not in events:
        hint = closest(name, events) if events else ""
        raise BadInput(f"system {system.name}: has no event {name!r}{hint}")
    return events[name]


def scaled_parameters(system: System, uncertain: Sequence[str], theta: Array) -> Array:
    """Return parameter values in which some parameters are multiples of their nominal values.

    Args:
        system: system with k parameters.
        uncertain: names of n parameters.
        theta: multiples of the nominal values, shape (S, n), dimensionless.

    Returns:
        Values of all parameters in SI units, shape (S, k).

    Raises:
        BadInput: if a name is unknown or repeated, or if the nominal value is zero.
        ValueError: if theta has another shape.

    Examples:
        >>> from pathlib import Path
        >>> from unmodelled.systems.reader import read_system
        >>> pendulum = read_system(Path("systems/pendulum.yaml"))
        >>> scaled_parameters(pendulum, ["J"], np.array([[1.0], [1.5]])).tolist()
        [[0.02, 0.01, 1.2], [0.03, 0.01, 1.2]]
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
    """Return the indices of parameters by their names.

    Args:
        system: system to look in.
        uncertain: names of parameters.

    Returns:
        Index of each name in `system.parameters`.

    Raises:
        BadInput: if a name is unknown or repeated, or if the nominal value is zero.
    """
    names = [p.name for p in system.parameters]
    for k, name in enumerate(uncertain):
        if name not in names:
            hint = closest(name, names) if names else ""
            raise BadInput(f"system {system.name}: has no parameter {name!r}{hint}")
        if name in uncertain[:k]:
            raise BadInput(f"system {system.name}: parameter {name!r} is named twice: name it once")
        if system.values[names.index(name)] == 0.0:
            raise BadInput(
                f"system {system.name}: parameter {name!r} is zero, and so is every multiple of it: "
                "give it another value, or hold it fixed"
            )
    return [names.index(name) for name in uncertain]


def event_times(
    system: System, event: str, uncertain: Sequence[str], theta: Array, runs: Experiments, step: float
) -> Array:
    """Simulate until an event and return its time, by the NumPy reference.

    Args:
        system: system with the event.
        event: name of the event.
        uncertain: names of n parameters.
        theta: multiples of the nominal values of `uncertain`, shape (S, n), dimensionless.
        runs: L experiments.
        step: integration step in s, a multiple of the sampling period.

    Returns:
        Times in s of the first fall through zero, shape (S, L); nan if the event does not happen within the
        log.

    Raises:
        BadInput: if the event or a parameter is unknown, or if `step` is not a multiple of the sampling
            period.

    Examples:
        >>> from unmodelled.systems.model import State, symbol
        >>> landing = Event("landing", symbol("x"))
        >>> state, rate = State("x", "m", 1.0), sp.Integer(-2)
        >>> fall = System("fall", (state,), (), (), (), (), (), (), {}, (rate,), {}, (landing,))
        >>> runs = Experiments(np.zeros((1, 11, 0)), 0.1, np.zeros((1, 0)), np.array([[1.0]]))
        >>> event_times(fall, "landing", [], np.zeros((1, 0)), runs, 0.1).round(6).tolist()
        [[0.5]]
    """
    moment = replace(event_named(system, event), then=None)
    for _, _, time in _march(system, moment, scaled_parameters(system, uncertain, theta), runs, step):
        if np.isfinite(time).all():
            break
    return time


def trajectories(
    system: System, event: str, uncertain: Sequence[str], theta: Array, runs: Experiments, step: float
) -> Trajectories:
    """Simulate to the end of the logs: with the first dynamics until the event, with the second ones after
    it.

    Args:
        system: system with the event.
        event: name of the event.
        uncertain: names of n parameters.
        theta: multiples of the nominal values of `uncertain`, shape (S, n), dimensionless.
        runs: L experiments.
        step: integration step in s, a multiple of the sampling period.

    Returns:
        States over time and event times.

    Raises:
        BadInput: as `event_times` does.
    """
    p = scaled_parameters(system, uncertain, theta)
    path = [(t, x, time) for t, x, time in _march(system, event_named(system, event), p, runs, step)]
    return Trajectories(np.array([t for t, _, _ in path]), np.stack([x for _, x, _ in path], 2), path[-1][2])


def _march(
    system: System, event: Event, p: Array, runs: Experiments, step: float
) -> Iterator[tuple[float, Array, Array]]:
    """Yield t, x (S, L, states) and the event times so far (S, L), step by step."""
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
    """Return the rates before or after the event, separately for each run."""
    if before is after or not happened.any():
        return before
    if happened.all():
        return after
    return lambda t, x: np.where(happened[..., None], after(t, x), before(t, x))


def _root(start: Array, middle: Array, end: Array) -> Array:
    """Return the share of the step at which the parabola through the three values falls through zero."""
    bend = 2.0 * (start - 2.0 * middle + end)
    slope = 4.0 * middle - 3.0 * start - end
    return np.asarray(2.0 * start / (np.sqrt(np.maximum(0.0, slope**2 - 4.0 * bend * start)) - slope))


@dataclass(frozen=True)
class Step:
    """One Runge-Kutta step that can be evaluated at any point in between.

    Attributes:
        x: states at the start of the step, shape (..., states).
        stages: four stages times the length of the step, each of shape (..., states).
    """

    x: Array
    stages: tuple[Array, Array, Array, Array]

    @classmethod
    def of(cls, rates: Rates, t: Array | float, x: Array, step: Array | float) -> Step:
        """Compute one step.

        Args:
            rates: function (t, x) -> x'.
            t: start time in s, a scalar or one per run, shape (...).
            x: states at the start, shape (..., states).
            step: length of the step in s, a scalar or one per run, shape (...).

        Returns:
            The step.
        """
        h = np.asarray(step)[..., None]
        k1 = h * rates(t, x)
        k2 = h * rates(t + 0.5 * step, x + 0.5 * k1)
        k3 = h * rates(t + 0.5 * step, x + 0.5 * k2)
        return cls(x, (k1, k2, k3, h * rates(t + step, x + k3)))

    def at(self, share: Array | float) -> Array:
        """Return the states within the step: accurate to fourth order at its end, to third order in between.

        Args:
            share: share of the step, 0 to 1, a scalar or an array of shape (..., 1).

        Returns:
            States of shape (..., states).
        """
        k1, k2, k3, k4 = self.stages
        square, cube = share * share, 2.0 / 3.0 * share**3
        first, last = share - 1.5 * square + cube, cube - 0.5 * square
        return np.asarray(self.x + first * k1 + (square - cube) * (k2 + k3) + last * k4)
