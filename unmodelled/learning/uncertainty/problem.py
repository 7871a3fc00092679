"""Observed outputs, one per operating point, and the response that should explain them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from unmodelled.base.errors import BadInput
from unmodelled.learning.uncertainty.event_response import event_response
from unmodelled.logs.events import event_times
from unmodelled.logs.folder import read_logs
from unmodelled.logs.logs import Logs
from unmodelled.logs.table import read_rows
from unmodelled.systems.model import System
from unmodelled.systems.reader import read_system
from unmodelled.uncertainty.response import Formula, Response

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Problem:
    """Data and model of an inverse uncertainty identification.

    Attributes:
        response: model of L outputs; if it is a system, its parameters are multiples of their nominal values.
        ids: names of the L operating points.
        y: observed outputs, shape (L,).
        deviation: standard errors of the observations, shape (L,); nan where unknown.
        unit: unit of the outputs.

    Raises:
        BadInput: when there are no observations.
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


def shown(problem: Problem, best: Array) -> pd.DataFrame:
    """Return the observations beside the outputs of constant parameters.

    Takes best (n,).
    """
    return pd.DataFrame(
        {
            "id": problem.ids,
            "y": problem.y,
            "deviation": problem.deviation,
            "deterministic": problem.response(best[None])[0],
        }
    )
