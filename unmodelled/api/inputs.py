"""Read the two inputs that simulation, diagnosis and identifiability share."""

from __future__ import annotations

from pathlib import Path

from unmodelled.logs.folder import read_logs
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System
from unmodelled.systems.reader import read_system


def read_inputs(system: Path, logs: Path) -> tuple[System, Logs]:
    """Read a system file and the logs of that system.

    Args:
        system: system file.
        logs: folder of logs, or an HDF5 file of them.

    Returns:
        The system, and its measured experiments.

    Raises:
        BadInput: when the system file or the logs cannot be used.
    """
    known = read_system(system)
    return known, read_logs(logs, known)
