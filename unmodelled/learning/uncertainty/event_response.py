"""Compute event times of measured experiments from a model: the shifting times Y_l of section 3.3."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from unmodelled.engine.cascade.cascade import common_states
from unmodelled.engine.cascade.event_times import EventTimes
from unmodelled.logs.differentiate import noise
from unmodelled.logs.logs import Logs
from unmodelled.systems.experiments import event_named
from unmodelled.systems.model import System

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

#: Starts that lie within so many standard deviations of the noise of their mean count as equal.
SAME = 6.0


def event_response(
    system: System,
    event: str,
    uncertain: Sequence[str],
    logs: Logs,
    step: float | None = None,
    threads: int | None = None,
) -> EventTimes:
    """Return the event times as a function of the uncertain parameters, one output per experiment.

    Every experiment has its own input, operating point and measured start. States that depend on the input
    only start alike in experiments with the same input: at the mean of their starts, if these differ by no
    more than noise. The integration step is in s.
    """
    u, group = inputs(logs)
    x0 = logs.x[logs.offsets[:-1]]
    for k in common_states(system, event_named(system, event), uncertain):
        deviation = noise_of(logs, k) if logs.measured[k] else 0.0
        x0[:, k] = same_starts(group, x0[:, k], deviation)
    duration = (np.diff(logs.offsets) - 1) * logs.period
    return EventTimes.of(
        system, event, uncertain, u, logs.period, logs.c, x0, step, threads=threads, duration=duration
    )


def inputs(logs: Logs) -> tuple[Array, Indices]:
    """Return inputs (experiments, samples, inputs), all as long as the longest, and their groups
    (experiments,).

    An input that ends earlier is continued by an input that begins alike, if there is one; otherwise it holds
    its last value. Experiments with equal inputs are a group.
    """
    lengths = np.diff(logs.offsets)
    distinct: list[Array] = []
    group = np.empty(len(logs), np.int64)
    for i in np.argsort(-lengths, kind="stable"):
        own = logs.u[logs.rows(i)]
        alike = (g for g, u in enumerate(distinct) if np.array_equal(u[: len(own)], own))
        group[i] = next(alike, len(distinct))
        if group[i] == len(distinct):
            distinct.append(own)
    longest = int(lengths.max())
    held = [np.concatenate([u, np.repeat(u[-1:], longest - len(u), axis=0)]) for u in distinct]
    return np.stack(held)[group], group


def noise_of(logs: Logs, k: int) -> float:
    """Estimate the standard deviation of the noise of a state."""
    return float(np.median([noise(logs.x[logs.rows(i), k]) for i in range(len(logs))]))


def same_starts(group: Indices, start: Array, deviation: float) -> Array:
    """Replace starts (experiments,) that differ only by noise within a group (experiments,) by their mean."""
    mean = (np.bincount(group, start) / np.bincount(group))[group]
    apart = np.bincount(group, np.abs(start - mean) > SAME * deviation)[group] > 0
    return np.where(apart, start, mean)
