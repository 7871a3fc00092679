"""System and logs as a caller gives them: objects, paths, data frames or results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import pandas as pd

from unmodelled.base.errors import BadInput
from unmodelled.logs.folder import read_logs
from unmodelled.logs.logs import Logs
from unmodelled.systems.given import SystemGiven, system_of
from unmodelled.systems.model import System

#: Column of one frame of many experiments that names the experiment of a row, as in `Logs.table`.
EXPERIMENT = "experiment"

#: What stands for logs: the logs, their folder or file, one data frame, several, or several by their ids.
LogsGiven: TypeAlias = Logs | Path | str | pd.DataFrame | Sequence[pd.DataFrame] | Mapping[str, pd.DataFrame]


def read_inputs(system: SystemGiven, logs: LogsGiven) -> tuple[System, Logs]:
    """Return the system and the logs that a caller gives in any form.

    Examples:
        >>> import unmodelled as um
        >>> system, logs = um.example("pendulum")
        >>> system.source.endswith("pendulum.yaml"), logs.table().columns.tolist()
        (True, ['experiment', 't', 'theta', 'torque'])
        >>> read_inputs(system.source, logs.table())[1].ids
        ('run1', 'run2', 'run3', 'run4')
    """
    known = system_of(system)
    if isinstance(logs, Logs):
        return known, logs
    if isinstance(logs, str | Path):
        return known, read_logs(logs, known)
    return known, Logs.from_frames(_frames(logs), known)


def _frames(given: Any) -> Mapping[str, pd.DataFrame]:
    if isinstance(given, pd.DataFrame):
        if EXPERIMENT in given.columns:
            return {str(name): frame for name, frame in given.groupby(EXPERIMENT, sort=False)}
        given = [given]
    named: Any = given
    if isinstance(given, Sequence) and not isinstance(given, str | bytes):
        named = {f"run{k + 1}": frame for k, frame in enumerate(given)}
    if not isinstance(named, Mapping):
        wanted = "logs, the path of their folder, a data frame, or data frames in a list or by their ids"
        raise BadInput(f"logs: must be {wanted}, got {type(given).__name__}")
    for name, frame in named.items():
        if not isinstance(frame, pd.DataFrame):
            raise BadInput(f"logs[{name!r}]: must be a data frame, got {type(frame).__name__}")
    return named
