"""Machines of the tests on disk: system files from their texts, log folders from tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

import unmodelled
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System

Table = pd.DataFrame | Mapping[str, NDArray[np.float64]]


def system_of(text: str, folder: Path) -> System:
    """The system of a system file with this text, which is written to `folder`."""
    (folder / "system.yaml").write_text(text)
    return unmodelled.read_system(folder / "system.yaml")


def write_runs(folder: Path, tables: Sequence[Table], **columns: Sequence[object]) -> Path:
    """A folder with a CSV file per run and experiments.csv, which names them run0, run1 and so on.

    `columns` are further columns of experiments.csv, which may have other ids.
    """
    folder.mkdir(parents=True, exist_ok=True)
    names = [f"run{k}" for k in range(len(tables))]
    for name, table in zip(names, tables, strict=True):
        pd.DataFrame(table).to_csv(folder / f"{name}.csv", index=False)
    listed = {"id": names, "file": [f"{name}.csv" for name in names], **columns}
    pd.DataFrame(listed).to_csv(folder / "experiments.csv", index=False)
    return folder


def logs_of(system: System, folder: Path, tables: Sequence[Table], **columns: Sequence[object]) -> Logs:
    """The logs of a log folder that is written of these tables."""
    return unmodelled.read_logs(write_runs(folder, tables, **columns), system)


def diagnosed(folder: Path, text: str, recorded: Path) -> unmodelled.Answer:
    """The diagnosis of a log folder by a system file with this text, which is written to `folder`."""
    known = system_of(text, folder)
    return unmodelled.diagnose(known, unmodelled.read_logs(recorded, known))
