"""Logs from data frames, with the checks and the refusals of a log folder."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pandas as pd

from unmodelled.base.errors import BadInput, Faults
from unmodelled.logs.assembly import assembled, check_log, in_si, units_of
from unmodelled.logs.cells import frame_numbers
from unmodelled.logs.constants import logged
from unmodelled.logs.measurements import M
from unmodelled.logs.recognition import refuse_missing
from unmodelled.logs.table import Columns, Rows, check_repeated
from unmodelled.systems.model import System

ORIGIN = {"data": "measured", "description": "data frames"}


def read_frames(
    kind: type[M], frames: Mapping[str, pd.DataFrame], system: System, experiments: pd.DataFrame | None
) -> M:
    """Read data frames as logs of a kind, as `Logs.from_frames` says."""
    table, faults, logs = _table(list(frames), experiments), Faults(), []
    if frames:
        refuse_missing("experiments: row 1", "the table", table[0], logged(system))
    for name, frame in frames.items():
        with faults.collected():
            log = _columns(Path(f"frames[{name!r}]"), frame, list(units_of(system)))
            check_log(log, system)
            logs.append(in_si(log, system))
    return assembled(kind, system, Path("experiments"), table, logs, ORIGIN, faults)


def _table(ids: list[str], experiments: pd.DataFrame | None) -> tuple[list[str], Rows]:
    """Return header and rows as experiments.csv would have them; the files are the ids."""
    if experiments is not None and (unknown := set(ids) ^ set(experiments.index)):
        raise BadInput(
            f"experiments: its index and the frames must have the same ids; {min(unknown)!r} is in one only"
        )
    more = [] if experiments is None else [name for name in experiments.columns if name not in ("id", "file")]
    rows: Rows = []
    for row, name in enumerate(ids, start=2):
        cells = [] if experiments is None else experiments.loc[name, more].tolist()
        rows.append((row, [str(cell).strip() for cell in (name, name, *cells)]))
    return ["id", "file", *map(str, more)], rows


def _columns(path: Path, frame: pd.DataFrame, wanted: list[str]) -> Columns:
    """Return the wanted columns of a frame; `path` is its name in messages."""
    frame = _with_time(frame)
    names = [str(name) for name in frame.columns]
    check_repeated(path, names)
    refuse_missing(f"{path}: row 1", "the frame", names, wanted)
    faults, values = Faults(), {}
    for name in wanted:
        with faults.collected():
            values[name] = frame_numbers(path, name, frame.iloc[:, names.index(name)])
    faults.check()
    return Columns(path, values, header=False)


def _with_time(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the frame with a column t: its index stands for a missing one, unless it only counts rows."""
    counts = pd.api.types.is_integer_dtype(frame.index.dtype)
    return frame if "t" in frame.columns or counts else frame.assign(t=frame.index)
