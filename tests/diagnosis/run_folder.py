"""Writing a log folder from tables."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd


def write_runs(folder: Path, tables: Sequence[pd.DataFrame]) -> Path:
    """A new folder with a CSV file per run and experiments.csv, which names them run0, run1 and so on."""
    folder.mkdir()
    names = [f"run{k}" for k in range(len(tables))]
    for name, table in zip(names, tables, strict=True):
        table.to_csv(folder / f"{name}.csv", index=False)
    files = [f"{name}.csv" for name in names]
    pd.DataFrame({"id": names, "file": files}).to_csv(folder / "experiments.csv", index=False)
    return folder
