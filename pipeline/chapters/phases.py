"""Simulations to an event and beyond in plain NumPy: the reference for the compiled event times.

Runge-Kutta method of order four with a fixed step. If the expression of the event falls through zero within a
step, the parabola through its values at the start, the middle and the end of the step gives the time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import sympy as sp

from unmodelled.base.arrays import Array, Mask
from unmodelled.systems.experiments import Experiments, event_named, uncertain_indices
from unmodelled.systems.functions import sanitised
from unmodelled.systems.model import Event, System
from unmodelled.systems.numeric import numpy_system_function

Rates = Callable[[Array | float, Array], Array]  # (t, x) -> x'


@dataclass(frozen=True)
class Trajectories:
    """Simulated states and event times of S parameter samples and L experiments."""

    t: Array  # (K,), s
    x: Array  # (S, L, K, states)
    time: Array  # (S, L), event times, s; nan if the event does not happen


def event_times(
    system: System, event: str, uncertain: Sequence[str], theta: Array, runs: Experiments, step: float
) -> Array:
    """Simulate until an event for parameters theta (S, n); return its times (S, L) by the NumPy reference."""
    moment = replace(event_named(system, event), then=None)
    for _, _, time in _march(system, moment, scaled_parameters(system, uncertain, theta), runs, step):
        if np.isfinite(time).all():
            break
    return time


def trajectories(
    system: System, event: str, uncertain: Sequence[str], theta: Array, runs: Experiments, step: float
) -> Trajectories:
    """Simulate to the end of the logs, with the second dynamics after the event, for theta (S, n)."""
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


def _joined(before: Rates, after: Rates, happened: Mask) -> Rates:
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
    """One Runge-Kutta step that can be evaluated at any point in between."""

    x: Array  # (..., states), at the start of the step
    stages: tuple[Array, Array, Array, Array]  # each (..., states), times the length of the step

    @classmethod
    def of(cls, rates: Rates, t: Array | float, x: Array, step: Array | float) -> Step:
        """Compute one step from t (...) and x (..., states); step (...) in s."""
        h = np.asarray(step)[..., None]
        k1 = h * rates(t, x)
        k2 = h * rates(t + 0.5 * step, x + 0.5 * k1)
        k3 = h * rates(t + 0.5 * step, x + 0.5 * k2)
        return cls(x, (k1, k2, k3, h * rates(t + step, x + k3)))

    def at(self, share: Array | float) -> Array:
        """Return the states (..., states) within the step, at share (..., 1).

        They are accurate to fourth order at its end, to third order in between.
        """
        k1, k2, k3, k4 = self.stages
        square, cube = share * share, 2.0 / 3.0 * share**3
        first, last = share - 1.5 * square + cube, cube - 0.5 * square
        return np.asarray(self.x + first * k1 + (square - cube) * (k2 + k3) + last * k4)


def scaled_parameters(system: System, uncertain: Sequence[str], theta: Array) -> Array:
    """Return parameters (S, k) of which some are multiples theta (S, n) of their nominal values."""
    values = np.array(system.values)
    index = uncertain_indices(system, uncertain)
    theta = np.asarray(theta, np.float64)
    if theta.ndim != 2 or theta.shape[1] != len(index):
        raise ValueError(f"theta must be (samples, {len(index)}), got {theta.shape}")
    p = np.tile(values, (len(theta), 1))
    p[:, index] = theta * values[index]
    return p
