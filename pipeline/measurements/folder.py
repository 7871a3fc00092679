"""Reading a log folder: experiments.csv and the logs that it names."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.errors import BadInput
from pipeline.measurements.angles import wrapped
from pipeline.measurements.clock import Kind, check_time, common_period, read_at, uniform_clock
from pipeline.measurements.constants import logged, with_constants
from pipeline.measurements.inputs import acting
from pipeline.measurements.logs import Logs, names
from pipeline.measurements.states import estimate
from pipeline.measurements.table import NUMBER, Columns, check_header, number, read_columns, read_rows
from pipeline.physics.system.model import System
from pipeline.shapes import ORIGIN, read_shaped

Array = NDArray[np.float64]


def read_logs(folder: Path, system: System) -> Logs:
    """The experiments in `folder`, a log folder or a store that `Logs.write` wrote.

    Args:
        folder: with experiments.csv (one row per experiment: `id`, `file`, the operating point where the
            system file does not give it, optionally `group`, anything else) and the CSV or Parquet files it
            names, with `t` in s and the columns of inputs and outputs. An optional provenance.json says where
            the data come from.
        system: what the columns mean. A store must have been written for a system with the same inputs and
            outputs.

    Raises:
        BadInput: one line that names file, row and column.
    """
    try:
        there = folder.is_dir()
    except OSError as error:
        raise BadInput(f"{folder}: cannot be read ({error.strerror})") from None
    if not there:
        raise BadInput(f"{folder}: no such folder")
    if (folder / "experiments.parquet").exists() and not (folder / "experiments.csv").exists():
        return Logs.read(folder, system)
    experiments, notes = _experiments(folder / "experiments.csv", system)
    columns = list(
        dict.fromkeys(["t", *(i.column for i in system.inputs), *(o.column for o in system.outputs)])
    )
    logs = [read_columns(folder / file, columns) for file in experiments["file"]]
    for log in logs:
        check_time(log)
        _check_alive(log, system)
    return _assembled(system, experiments, logs, notes, _provenance(folder))


def _experiments(path: Path, system: System) -> tuple[pd.DataFrame, list[str]]:
    """The table, and notes."""
    constants = logged(system)
    header, rows = read_rows(path)
    check_header(path, header, ["id", "file", *constants])
    if not rows:
        raise BadInput(f"{path}: row 1: column id: no experiments below it")
    at = {name: k for k, name in enumerate(header) if name}
    table: dict[str, list[Any]] = {name: [cells[k] for _, cells in rows] for name, k in at.items()}
    first: dict[str, int] = {}
    for (row, _), name, file in zip(rows, table["id"], table["file"], strict=True):
        if not name:
            raise BadInput(f"{path}: row {row}: column id: is empty")
        if name in first:
            raise BadInput(f"{path}: row {row}: column id: {name!r} stands in row {first[name]} already")
        first[name] = row
        _check_file(path, row, file)
    for name in constants:
        table[name] = [number(path, row, name, cells[at[name]]) for row, cells in rows]
    if "group" in table:  # an experiment without a group is one of its own
        table["group"] = [group or name for group, name in zip(table["group"], table["id"], strict=True)]
    for name in set(table) - {"id", "file", "group", *constants}:
        if all(NUMBER.fullmatch(cell) for cell in table[name]):
            table[name] = [float(cell) for cell in table[name]]
    return with_constants(system, pd.DataFrame(table), [f"{path}: row {row}: column id" for row, _ in rows])


def _check_file(path: Path, row: int, file: str) -> None:
    """Refuse what does not lie in the folder, and what is not there."""
    posix, windows = PurePosixPath(file), PureWindowsPath(file)
    where = f"{path}: row {row}: column file"
    if not file:
        raise BadInput(f"{where}: is empty")
    if posix.is_absolute() or windows.anchor or ".." in (*posix.parts, *windows.parts):
        raise BadInput(f"{where}: {file!r} must lie in the folder")
    try:
        found = (path.parent / file).is_file()
    except (OSError, ValueError):
        found = False
    if not found:
        raise BadInput(f"{where}: {file!r}: no such file")


def _check_alive(log: Columns, system: System) -> None:
    for output in system.outputs:
        values = log.values[output.column]
        if np.ptp(values) == 0.0:
            raise BadInput(
                f"{log.path}: row {log.row(0)}: column {output.column}: dead output, "
                f"{values[0]:g} in every row"
            )


def _provenance(folder: Path) -> dict[str, Any]:
    path = folder / "provenance.json"
    if not path.exists():
        return {"data": "measured", "description": f"log folder {folder.resolve().name}"}
    content: dict[str, Any] = read_shaped(path, ORIGIN)
    return content


def _assembled(
    system: System,
    experiments: pd.DataFrame,
    logs: Sequence[Columns],
    notes: list[str],
    provenance: dict[str, Any],
) -> Logs:
    ids = tuple(experiments["id"])
    period = common_period(logs)
    clocks, moves = zip(*(uniform_clock(log.values["t"], period) for log in logs), strict=True)
    offsets = np.concatenate([[0], np.cumsum([len(clock) for clock in clocks])]).astype(np.int64)
    pairs = list(zip(logs, clocks, strict=True))
    y, u = np.empty((offsets[-1], len(system.outputs))), np.empty((offsets[-1], len(system.inputs)))
    notes = [*notes, *_moved(ids, moves, period)]
    for j, output in enumerate(system.outputs):
        columns = [log.values[output.column] for log in logs]
        turning = [output.unit.strip() == "rad" and wrapped(column) for column in columns]
        columns = [np.unwrap(v) if turns else v for v, turns in zip(columns, turning, strict=True)]
        y[:, j] = _read(columns, pairs, "cubic")
        if any(turning):
            notes.append(f"{output.name} was unwrapped")
    for j, item in enumerate(system.inputs):
        u[:, j] = _read([log.values[item.column] for log in logs], pairs, "linear")
    delays = tuple(item.delay for item in system.inputs)
    u = acting(system, ids, u, offsets, period, delays)
    c = experiments[[constant.name for constant in system.operating_point]].to_numpy(np.float64)
    found = estimate(system, ids, period, offsets, y, u, c)
    return Logs(
        *names(system),
        ids=ids,
        experiments=experiments,
        period=period,
        offsets=offsets,
        t=np.concatenate([period * np.arange(len(clock)) for clock in clocks]),
        y=y,
        u=u,
        c=c,
        x=found.x,
        measured=found.measured,
        notes=(*notes, *found.notes),
        provenance=provenance,
        delays=delays,
    )


def _read(columns: Sequence[Array], pairs: Sequence[tuple[Columns, Array]], kind: Kind) -> Array:
    """A column of every log at the instants of its uniform clock, one after the other."""
    return np.concatenate(
        [
            read_at(log.values["t"], values, clock, kind)
            for values, (log, clock) in zip(columns, pairs, strict=True)
        ]
    )


def _moved(ids: Sequence[str], moves: Sequence[float], period: float) -> list[str]:
    """What happened to the clocks."""
    moved = np.count_nonzero(moves)
    if not moved:
        return []
    worst = int(np.argmax(moves))
    return [
        f"{moved} of {len(ids)} logs were put on a uniform clock of {period:.6g} s by interpolation; samples "
        f"moved by up to {100.0 * moves[worst]:.3g} % of a period ({ids[worst]})"
    ]
