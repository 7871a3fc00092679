"""Observed outputs, one per operating point, and the response that should explain them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from unmodelled.base.arrays import Array, Indices
from unmodelled.base.errors import BadInput
from unmodelled.engine.cascade.cascade import common_states
from unmodelled.engine.cascade.event_times import EventTimes
from unmodelled.logs.differentiate import noise
from unmodelled.logs.events import event_times
from unmodelled.logs.folder import read_logs
from unmodelled.logs.logs import Logs
from unmodelled.logs.table import read_rows
from unmodelled.systems.experiments import event_named
from unmodelled.systems.model import System
from unmodelled.systems.reader import read_system
from unmodelled.uncertainty.response import Formula, Response

#: Starts that lie within so many standard deviations of the noise of their mean count as equal.
SAME = 6.0


@dataclass(frozen=True)
class Problem:
    """Data and model of an inverse uncertainty identification."""

    response: Response  # of L outputs; parameters of a system are multiples of its values
    ids: tuple[str, ...]  # of the L operating points
    y: Array  # (L,), observed outputs
    deviation: Array  # (L,), standard errors; nan where unknown
    unit: str  # of the outputs

    def __post_init__(self) -> None:
        if not len(self.y):
            raise BadInput("observations: there are none")


def read_problem(
    system: Path | None,
    logs: Path | None,
    event: str | None,
    uncertain: Sequence[str] | None,
    step: float | None,
    response: Response | None,
    observations: Path | None,
) -> Problem:
    """Read a system with its logs, or observations of a given response."""
    if system is not None and logs is not None and response is None and observations is None:
        model = read_system(system)
        _asked(model, event, uncertain)  # before logs are read that belong to another system
        return of_system(model, read_logs(logs, model), event, uncertain, step)
    if response is not None and observations is not None and system is None and logs is None:
        return of_observations(response, read_observations(observations), str(observations))
    raise BadInput("give system=... and logs=..., or response._target_=... and observations=...")


def of_system(
    system: System, logs: Logs, event: str | None, uncertain: Sequence[str] | None, step: float | None
) -> Problem:
    """Return the measured times of an event, and these times as a function of uncertain parameters."""
    name, chosen = _asked(system, event, uncertain)
    observed = event_times(logs, system, name)
    response = event_response(system, name, chosen, logs, step)
    y, deviation = (observed[column].to_numpy(np.float64) for column in ("time", "deviation"))
    return Problem(response, logs.ids, y, deviation, "s")


def of_observations(response: Response, observations: pd.DataFrame, place: str = "observations") -> Problem:
    """Pair observations with the response that they belong to, in the order of its outputs."""
    if lacking := {"id", "y"} - {*observations.columns}:
        raise BadInput(f"{place}: column {min(lacking)} is missing")
    y = observations["y"].to_numpy(np.float64)
    if not len(y):
        raise BadInput(f"{place}: row 1: no observations below it")
    if not np.isfinite(y).all():
        raise BadInput(f"{place}: row {np.argmin(np.isfinite(y)) + 1}: column y: is not a finite number")
    deviation = np.full(len(y), np.nan)
    if "deviation" in observations:
        deviation = observations["deviation"].to_numpy(np.float64)
    outputs = np.shape(response(response.bounds.mean(axis=1)[None]))[-1]
    if outputs != len(y):
        raise BadInput(f"{place}: must have {outputs} rows, one for every output of the model, got {len(y)}")
    return Problem(response, tuple(map(str, observations["id"])), y, deviation, "")


def read_observations(path: Path) -> pd.DataFrame:
    """Read observations from a CSV file with the columns id and y, optionally deviation."""
    table = read_rows(path, ["id", "y"])
    columns = [name for name in ("y", "deviation") if name in table.header]
    return pd.DataFrame({name: table.numbers(name) for name in columns}).assign(id=table.column("id"))


def callable_response(
    function: Callable[[Array], Array], names: Sequence[str], bounds: Sequence[Sequence[float]]
) -> Formula:
    """Wrap a Python function as a response (see conf/identify_uncertainty.yaml).

    Args:
        function: function from parameters, shape (S, n), to outputs, shape (S, L).
        names: names of the n parameters.
        bounds: lower and upper bound of every parameter, n pairs.

    Raises:
        BadInput: when the bounds are not an increasing pair per parameter.
    """
    box = np.array([list(pair) for pair in bounds], np.float64)
    if box.shape != (len(names), 2) or not (box[:, 0] < box[:, 1]).all():
        raise BadInput(f"bounds: must be [low, high] for each of {', '.join(names)}, got {box.tolist()}")
    return Formula(tuple(names), box, function)


def _asked(system: System, event: str | None, uncertain: Sequence[str] | None) -> tuple[str, tuple[str, ...]]:
    """The event and the uncertain parameters, named or those of the system."""
    if event is None and len(system.events) != 1:
        known = ", ".join(e.name for e in system.events) or "none"
        raise BadInput(f"{system.place}: events: must be one unless event=... names it, got {known}")
    chosen = system.uncertain if uncertain is None else tuple(str(n) for n in uncertain)
    if not chosen:
        raise BadInput(f"{system.place}: no parameter is marked `identify: true`, and none was named")
    return system.events[0].name if event is None else event, chosen


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
