"""Compute the time of an event of a system, for many samples of uncertain parameters and operating points."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import sympy as sp

from unmodelled.base.arrays import Array, Indices
from unmodelled.base.workers import threads_of
from unmodelled.engine.cascade import cascade_loops
from unmodelled.engine.cascade.cascade import Cascade
from unmodelled.engine.cascade.cascade_loops import LANES, Generated, Places
from unmodelled.engine.cascade.cascade_source import CascadeSource
from unmodelled.engine.compiled.compiled import digest, generated
from unmodelled.systems.experiments import Experiments, event_named, uncertain_indices
from unmodelled.systems.model import TIME, System

#: What the generated code depends on besides the model, seen from the folder of the engine.
_GENERATOR = (
    *(f"compiled/{name}.py" for name in ("layout", "scalars", "source", "printer")),
    *(f"cascade/{name}.py" for name in ("cascade", "cascade_source", "cascade_loops")),
    *("../systems/functions.py", "../systems/procedure.py", "../systems/tables.py"),
)
#: Samples that one thread works on at a time.
_PIECE = 32 * LANES
#: Times of the step that is chosen may differ from those of the shortest one by this much, s.
_TOLERANCE = 1e-4
#: Steps that a log has at least, when the step is chosen.
_FEWEST = 100


@dataclass(frozen=True)
class SameInput:
    """Operating points with the same input, whose driven and shared states start alike; all in SI."""

    members: Indices  # (members,), indices of the operating points
    #: (moments * quantities,), time, inputs and driven states that the equations use, at every half step
    clock: Array
    shared: Array  # (shared states,), initial values
    own: Array  # (members, own states), initial values
    c: Array  # (members, constants)


@dataclass(frozen=True)
class EventTimes:
    """Compiled event times of one system at some operating points; call it with samples.

    Method of Runge and Kutta of order four. States that the input alone drives are integrated once per input,
    with steps of at most half of `step` and no longer than the sampling period; see `Cascade`.
    """

    names: tuple[str, ...]  # uncertain parameters
    nominal: Array  # (uncertain,), values, SI
    bounds: Array  # (uncertain, 2), as multiples of the nominal values
    p: Array  # (parameters,), all parameters, SI
    inputs: tuple[SameInput, ...]
    duration: Array  # (points,), durations of the logs, s
    step: float  # s
    steps: int  # number of steps of the longest log
    threads: int
    functions: Generated
    places: Places

    @classmethod
    def of(
        cls,
        system: System,
        event: str,
        uncertain: Sequence[str],
        u: Array,
        period: float,
        c: Array,
        x0: Array,
        step: float | None = None,
        threads: int | None = None,
        duration: Array | None = None,
    ) -> EventTimes:
        """Compile (once; kept on disk) and integrate what no sample changes.

        Takes u (points, samples, inputs), c (points, constants), x0 (points, states), SI; duration (points,)
        in s.
        """
        u, c, x0 = (np.asarray(a, np.float64) for a in (u, c, x0))
        runs = Experiments(u, period, c, x0)
        if step is None:
            step = _longest_step(system, event, uncertain, runs)
        steps = runs.steps(step)
        crossing = event_named(system, event)
        index = uncertain_indices(system, uncertain)
        source = CascadeSource(system, Cascade.of(system, crossing, uncertain))
        code = digest(_GENERATOR, system, [sp.srepr(crossing.expression), repr(tuple(uncertain))])
        module = generated(f"event_{code}", source.text)
        functions = Generated(*(getattr(module, name) for name in Generated._fields))
        p = np.array(system.values)
        end = (runs.u.shape[1] - 1) * period
        return cls(
            tuple(uncertain),
            p[index],
            np.sort([np.array(system.parameters[k].limits) / p[k] for k in index], axis=1),
            p,
            _by_input(source.cascade, system, runs, step, functions),
            np.full(len(runs), end) if duration is None else np.asarray(duration, np.float64),
            step,
            steps,
            threads or os.cpu_count() or 1,
            functions,
            source.places(),
        )

    def __call__(self, theta: Array) -> Array:
        """Return the event times (samples, points), s, of samples theta (samples, uncertain)."""
        theta = np.asarray(theta, np.float64)
        if theta.ndim != 2 or theta.shape[1] != len(self.names):
            raise ValueError(f"theta must be (samples, {len(self.names)}), got {theta.shape}")
        samples = theta * self.nominal
        size = min(_PIECE, LANES * -(-len(samples) // (LANES * self.threads)))
        pieces = [samples[a : a + size] for a in range(0, len(samples), max(1, size))]
        with threads_of(self.threads) as pool:
            times = np.concatenate([np.empty((0, len(self.duration))), *pool.map(self._piece, pieces)])
        times[times > self.duration] = np.nan
        return times

    def _piece(self, samples: Array) -> Array:
        """Times of some samples, input by input."""
        times, order = np.empty((len(samples), len(self.duration))), np.arange(len(samples))
        for same in self.inputs:
            found = cascade_loops.event_times(
                *(*self.functions[1:], self.places, samples[order], self.p),
                *(same.shared, same.own, same.c, same.clock, self.steps, self.step),
            )
            times[np.ix_(order, same.members)] = found
            # a block runs until its last sample is done: those that take long go together
            order = order[np.argsort(found[:, 0])]
        return times


def _by_input(
    cascade: Cascade, system: System, runs: Experiments, step: float, functions: Generated
) -> tuple[SameInput, ...]:
    common = [*cascade.driven, *cascade.shared]
    groups: dict[bytes, list[int]] = {}
    for i in range(len(runs)):
        groups.setdefault(runs.u[i].tobytes() + runs.x0[i, common].tobytes(), []).append(i)
    return tuple(
        _same(cascade, system, runs.only(members), members, step, functions) for members in groups.values()
    )


def _same(
    cascade: Cascade, system: System, runs: Experiments, members: list[int], step: float, functions: Generated
) -> SameInput:
    start = runs.x0[0]
    one, driven = runs.only([0]), list(cascade.driven)
    periods = round(step / runs.period)
    # every sample of the input is the start or the end of a step
    parts = periods if periods % 2 else periods // 2
    steps = 2 * runs.steps(step) * parts
    h = 0.5 * step / parts
    t = np.linspace(0.0, steps * h, 2 * steps + 1)
    forcing = np.column_stack([t, one.input(t[:, None])[:, 0]])
    x = np.empty((steps + 1, len(driven)))
    x[0] = start[driven]
    functions.drive(x.reshape(-1), np.array(system.values), forcing.reshape(-1), steps, h)
    known = dict(zip((TIME, *system.u), forcing[:: 2 * parts].T, strict=True))
    known |= dict(zip((system.x[k] for k in driven), x[::parts].T, strict=True))
    clock = np.array([known[s] for s in cascade.clock]).T
    return SameInput(
        np.array(members),
        np.ascontiguousarray(clock).reshape(-1),
        start[list(cascade.shared)],
        np.ascontiguousarray(runs.x0[:, list(cascade.own)]),
        np.ascontiguousarray(runs.c),
    )


def _longest_step(system: System, event: str, uncertain: Sequence[str], runs: Experiments) -> float:
    """A power of two of periods whose times, at the nominal values and a tenth around, are good enough."""
    theta = np.array([[1.0], [0.9], [1.1]]) * np.ones(len(uncertain))

    def times(periods: int) -> Array:
        step = periods * runs.period
        return EventTimes.of(system, event, uncertain, runs.u, runs.period, runs.c, runs.x0, step)(theta)

    periods, best = 1, times(1)
    while 2 * periods * _FEWEST < runs.u.shape[1] and np.allclose(
        times(2 * periods), best, rtol=0.0, atol=_TOLERANCE, equal_nan=True
    ):
        periods *= 2
    return periods * runs.period
