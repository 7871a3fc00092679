"""Logs from data frames, read like a log folder: the same checks and the same refusals."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import pandas as pd
import pyarrow as pa

from unmodelled.base.errors import BadInput
from unmodelled.base.files import write_json
from unmodelled.base.parquet import write_parquet
from unmodelled.logs.folder import read_logs
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System

ORIGIN = {"data": "measured", "description": "data frames"}


def read_frames(
    frames: Mapping[str, pd.DataFrame], system: System, experiments: pd.DataFrame | None = None
) -> Logs:
    """Read data frames as `Logs.from_frames` says, by way of a temporary log folder.

    Args:
        frames: experiments by their ids.
        system: system whose inputs and outputs name the columns.
        experiments: optional table of the experiments, with their ids as index.

    Raises:
        BadInput: a line for every fault, which names frame, row and column.
    """
    names = {f"{k}.parquet": name for k, name in enumerate(frames)}
    with TemporaryDirectory() as place:
        folder = Path(place)
        shown = {str(folder / file): f"frames[{name!r}]" for file, name in names.items()}
        shown |= {str(folder / "experiments.csv"): "experiments", str(folder): "frames"}
        _write_table(folder / "experiments.csv", names, experiments)
        write_json(folder / "provenance.json", ORIGIN)
        for file, name in names.items():
            _write_frame(folder / file, name, frames[name])
        try:
            found = read_logs(folder, system)
        except BadInput as fault:
            first, *others = (_renamed(line, shown) for line in (str(fault), *fault.others))
            raise BadInput(first, others) from None
    return replace(found, source="")


def _write_table(path: Path, names: Mapping[str, str], experiments: pd.DataFrame | None) -> None:
    """Write experiments.csv with a row for every frame."""
    if experiments is not None and (unknown := set(names.values()) ^ set(experiments.index)):
        raise BadInput(
            f"experiments: its index and the frames must have the same ids; {min(unknown)!r} is in one only"
        )
    more = [] if experiments is None else [name for name in experiments.columns if name not in ("id", "file")]
    with path.open("w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["id", "file", *more])
        for log, name in names.items():
            cells = [] if experiments is None else experiments.loc[name, more].tolist()
            rows.writerow([name, log, *cells])


def _write_frame(path: Path, name: str, frame: pd.DataFrame) -> None:
    try:
        write_parquet(frame.reset_index(drop=True), path)
    except (pa.ArrowException, ValueError, TypeError) as error:
        raise BadInput(f"frames[{name!r}]: {error}: give columns of numbers with texts as names") from None


def _renamed(line: str, shown: Mapping[str, str]) -> str:
    """A message about the temporary folder as one about the frames."""
    for path, name in shown.items():
        line = line.replace(path, name)
    return line
