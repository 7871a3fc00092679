"""System and logs as a caller gives them: objects, paths, data frames or results."""

from __future__ import annotations

from pathlib import Path
from typing import TypeAlias

from unmodelled.logs.folder import read_logs
from unmodelled.logs.frames import FramesGiven
from unmodelled.logs.logs import Logs
from unmodelled.systems.given import SystemGiven, system_of
from unmodelled.systems.model import System

#: What stands for logs: the logs, their folder or file, one data frame, several, or several by their ids.
LogsGiven: TypeAlias = Logs | Path | str | FramesGiven


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
    return known, Logs.from_frames(logs, known)
