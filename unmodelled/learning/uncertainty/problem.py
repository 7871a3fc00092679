"""Observed outputs, one an operating point, and the model that should explain them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from unmodelled.base.errors import BadInput
from unmodelled.logs.events import event_times
from unmodelled.logs.folder import read_logs
from unmodelled.logs.table import numbers, read_rows
from unmodelled.models.event_response import event_response
from unmodelled.systems.model import System
from unmodelled.systems.reader import read_system
from unmodelled.uncertainty.response import Formula, Response

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Problem:
    """What is to be explained.

    Attributes:
        response: the model; its parameters are multiples of their nominal values where it is a system.
        ids: (L,) of the operating points. y: (L,) observed outputs.
        deviation: (L,) standard errors of the observations, nan where unknown.
        unit: of the outputs.
    """

    response: Response
    ids: tuple[str, ...]
    y: Array
    deviation: Array
    unit: str

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
    """A system with its logs, or a response with observations.

    Raises:
        BadInput: when neither or both are given, or they cannot be used.
    """
    if system is not None and logs is not None and response is None and observations is None:
        return of_system(system, logs, event, uncertain, step)
    if response is not None and observations is not None and system is None and logs is None:
        return of_observations(response, observations)
    raise BadInput("give system=... and logs=..., or response._target_=... and observations=...")


def of_system(
    path: Path, logs: Path, event: str | None, uncertain: Sequence[str] | None, step: float | None
) -> Problem:
    """The moments of an event, in the logs and as a function of uncertain parameters of the system.

    Args:
        path: system file. logs: log folder.
        event: its name; null: the only one. uncertain: names of parameters; null: those that the file marks.
        step: of the integration, s; null: see `EventTimes`.

    Raises:
        BadInput: when the file has no such event or nothing uncertain, or the logs do not show the event.
    """
    system = read_system(path)
    name = _only_event(path, system) if event is None else event
    chosen = system.uncertain if uncertain is None else tuple(str(n) for n in uncertain)
    if not chosen:
        raise BadInput(f"{path}: no parameter is marked `identify: true`, and none was named")
    measured = read_logs(logs, system)
    observed = event_times(measured, system, name)
    response = event_response(system, name, chosen, measured, step)
    y, deviation = (observed[column].to_numpy(np.float64) for column in ("time", "deviation"))
    return Problem(response, measured.ids, y, deviation, "s")


def of_observations(response: Response, path: Path) -> Problem:
    """Observations from a CSV file with the columns id and y (optionally deviation), in the model's order.

    Raises:
        BadInput: naming row and column, or when the model has another number of outputs.
    """
    header, rows = read_rows(path, ["id", "y"])
    if not rows:
        raise BadInput(f"{path}: row 1: no observations below it")
    at = {name: k for k, name in enumerate(header)}
    ids = tuple(cells[at["id"]] for _, cells in rows)
    y = np.array(numbers(path, "y", rows, at["y"]))
    deviation = np.full(len(y), np.nan)
    if "deviation" in at:
        deviation = np.array(numbers(path, "deviation", rows, at["deviation"]))
    outputs = np.shape(response(response.bounds.mean(axis=1)[None]))[-1]
    if outputs != len(y):
        raise BadInput(f"{path}: must have {outputs} rows, one for every output of the model, got {len(y)}")
    return Problem(response, ids, y, deviation, "")


def callable_response(
    function: Callable[[Array], Array], names: Sequence[str], bounds: Sequence[Sequence[float]]
) -> Formula:
    """A Python function of theta, (S, n) to (S, L), as a response (see conf/identify_uncertainty.yaml)."""
    box = np.array([list(pair) for pair in bounds], np.float64)
    if box.shape != (len(names), 2) or not (box[:, 0] < box[:, 1]).all():
        raise BadInput(f"bounds: must be [low, high] for each of {', '.join(names)}, got {box.tolist()}")
    return Formula(tuple(names), box, function)


def _only_event(path: Path, system: System) -> str:
    if len(system.events) != 1:
        known = ", ".join(e.name for e in system.events) or "none"
        raise BadInput(f"{path}: events: must be one unless event=... names it, got {known}")
    return system.events[0].name


def shown(problem: Problem, best: Array) -> pd.DataFrame:
    """One row a point: id, y, deviation and `deterministic`, the output at `best` (n,)."""
    return pd.DataFrame(
        {
            "id": problem.ids,
            "y": problem.y,
            "deviation": problem.deviation,
            "deterministic": problem.response(best[None])[0],
        }
    )
