"""Log folders from tables, and diagnoses of them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

import unmodelled


def write_runs(folder: Path, tables: Sequence[pd.DataFrame]) -> Path:
    """A new folder with a CSV file per run and experiments.csv, which names them run0, run1 and so on."""
    folder.mkdir()
    names = [f"run{k}" for k in range(len(tables))]
    for name, table in zip(names, tables, strict=True):
        table.to_csv(folder / f"{name}.csv", index=False)
    files = [f"{name}.csv" for name in names]
    pd.DataFrame({"id": names, "file": files}).to_csv(folder / "experiments.csv", index=False)
    return folder


def diagnosed(folder: Path, system: str, recorded: Path) -> unmodelled.Answer:
    """The diagnosis of a log folder; `system` is the text of a system file, written to `folder`."""
    (folder / "system.yaml").write_text(system)
    known = unmodelled.read_system(folder / "system.yaml")
    return unmodelled.diagnose(known, unmodelled.read_logs(recorded, known))
