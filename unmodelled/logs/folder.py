"""Reading a log folder: experiments.csv and the logs that it names."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from unmodelled.base.errors import BadInput, Faults, nearest
from unmodelled.base.limits import check_file
from unmodelled.base.shapes import ORIGIN, read_shaped
from unmodelled.logs.clock import Kind, check_time, common_period, read_at, uniform_clock
from unmodelled.logs.constants import logged, with_constants
from unmodelled.logs.hdf5 import Address, is_hdf5, read_campaign, read_hdf5
from unmodelled.logs.logs import Logs
from unmodelled.logs.preparation import prepare, with_delays
from unmodelled.logs.recognition import NUMBER, foreign
from unmodelled.logs.table import (
    SMALLEST,
    Columns,
    Rows,
    check_header,
    check_texts,
    numbers,
    read_columns,
    read_rows,
)
from unmodelled.systems.model import System

Array = NDArray[np.float64]

TURN = 2.0 * np.pi  # rad


def read_logs(folder: Path | str, system: System) -> Logs:
    """Read the experiments of a log folder, of an HDF5 file, or of a store that `Logs.write` wrote.

    Args:
        folder: log folder with experiments.csv (one row per experiment: `id`, `file`, the operating point
            where the system file does not give it, optionally `group`, anything else) and the CSV, Parquet or
            HDF5 files it names, with `t` in s and the columns of inputs and outputs. An optional
            provenance.json says where the data come from. Or an HDF5 file with a group per experiment
            (`hdf5.read_campaign`).
        system: system whose inputs and outputs name the columns. A store must have been written for a system
            with the same inputs and outputs.

    Returns:
        The experiments on one uniform clock.

    Raises:
        BadInput: a line for every fault in the folder, which names file, row and column.

    Examples:
        >>> import unmodelled as um
        >>> system, logs = um.example("pendulum")
        >>> um.read_logs(logs.source, system)
        4 experiments, 1600 samples every 0.005 s, up to 2 s long
        outputs: theta
        inputs: torque
        note: omega was estimated from theta by smoothing differentiation over 21 samples
    """
    folder = Path(folder)
    check_file(folder)
    faults = Faults()
    if folder.is_file() and is_hdf5(folder):
        table = folder
        header, rows, provenance = read_campaign(folder, logged(system))
    else:
        _check_folder(folder)
        if (folder / "experiments.parquet").exists() and not (folder / "experiments.csv").exists():
            return replace(prepare(system, _stored(folder, system)), source=str(folder))
        table = folder / "experiments.csv"
        header, rows = read_rows(table, ["id", "file"])
    with faults.collected():
        experiments, notes = _experiments(table, header, rows, system)
    logs = _logs(table, [(row, cells[header.index("file")]) for row, cells in rows], system, faults)
    if not folder.is_file():
        with faults.collected():
            provenance = _provenance(folder)
    if logs:
        with faults.collected():
            period = common_period(logs)
    faults.check()
    found = prepare(system, _assembled(system, experiments, logs, period, notes, provenance))
    return replace(found, source=str(folder))


def _stored(folder: Path, system: System) -> Logs:
    """Read a store; its inputs act after the delays of `system`."""
    logs = Logs.read(folder, system)
    try:
        return with_delays(system, logs)
    except BadInput as error:
        raise BadInput(f"{folder}: {error}") from None


def _check_folder(folder: Path) -> None:
    """Refuse what is no folder, and a folder without a table of its logs."""
    try:
        if folder.is_file():
            wanted = "a folder with experiments.csv and the logs"
            raise foreign(folder, wanted) or BadInput(f"{folder}: is a file, not {wanted}")
        if not folder.is_dir():
            raise BadInput(f"{folder}: no such folder")
        files = [path.name for path in folder.iterdir()]
    except OSError as error:
        raise BadInput(f"{folder}: cannot be read ({error.strerror})") from None
    if "experiments.csv" not in files and "experiments.parquet" not in files:
        near = nearest("experiments.csv", files)
        advice = f"there is {near!r}: rename it" if near else "write one with a row (id, file) per log"
        raise BadInput(f"{folder / 'experiments.csv'}: no such file; {advice}")


def _experiments(path: Path, header: list[str], rows: Rows, system: System) -> tuple[pd.DataFrame, list[str]]:
    """The table, and notes."""
    constants, faults = logged(system), Faults()
    with faults.collected():
        check_header(path, header, ["id", "file", *constants])
    if not rows:
        raise BadInput(f"{path}: row 1: column id: no experiments below it")
    at = {name: k for k, name in enumerate(header) if name}
    table: dict[str, list[Any]] = {name: [cells[k] for _, cells in rows] for name, k in at.items()}
    with faults.collected():
        _check_ids(path, [row for row, _ in rows], table["id"])
    for name in [name for name in constants if name in at]:
        with faults.collected():
            table[name] = list(numbers(path, name, rows, at[name]))
    faults.check()
    if "group" in table:  # an experiment without a group is one of its own
        table["group"] = [group or name for group, name in zip(table["group"], table["id"], strict=True)]
    for name in set(table) - {"id", "file", "group", *constants}:
        if all(NUMBER.fullmatch(cell) for cell in table[name]):
            table[name] = [float(cell) for cell in table[name]]
    experiments = pd.DataFrame(table)
    check_texts(path, experiments, [row for row, _ in rows])
    return with_constants(system, experiments, [f"{path}: row {row}: column id" for row, _ in rows])


def _check_ids(path: Path, rows: Sequence[int], ids: Sequence[str]) -> None:
    """Refuse ids that are empty or there twice, a line for each."""
    first: dict[str, int] = {}
    faults = Faults()
    for row, name in zip(rows, ids, strict=True):
        if not name:
            faults.add(f"{path}: row {row}: column id: is empty")
        elif name in first:
            faults.add(f"{path}: row {row}: column id: {name!r} stands in row {first[name]} already")
        else:
            first[name] = row
    faults.check()


def _logs(table: Path, named: Sequence[tuple[int, str]], system: System, faults: Faults) -> list[Columns]:
    """The logs that the rows of `table` name, those with a fault left out."""
    units = {"t": "s"}
    units |= {i.column: i.unit for i in system.inputs} | {o.column: o.unit for o in system.outputs}
    files = {file.partition(":/")[0] for _, file in named}
    spare = sorted({path.name for path in table.parent.iterdir()} - {table.name, *files})
    packed: dict[Address, None] = {}
    for row, file in named:
        with suppress(BadInput):  # is told below, in the order of the rows
            place = _place(table, row, file, spare)
            packed |= {place: None} if is_hdf5(place.file) else {}
    read, logs = read_hdf5(list(packed), units, faults), []
    for row, file in named:
        with faults.collected():
            place = _place(table, row, file, spare)
            if place in read or place not in packed:
                log = read[place] if place in packed else read_columns(place.file, list(units))
                _check_log(log, system)
                logs.append(log)
    return logs


def _place(path: Path, row: int, file: str, spare: Sequence[str]) -> Address:
    """The log that a row names; refuse what does not lie in the folder, and what is not there.

    Files that no row names are `spare`.
    """
    posix, windows = PurePosixPath(file), PureWindowsPath(file)
    where = f"{path}: row {row}: column file"
    if not file:
        raise BadInput(f"{where}: is empty")
    if posix.is_absolute() or windows.anchor or ".." in (*posix.parts, *windows.parts):
        raise BadInput(f"{where}: {file!r} must lie in the folder")
    name, _, group = file.partition(":/")
    try:
        found = (path.parent / name).exists() and not (path.parent / name).is_dir()
    except (OSError, ValueError):
        found = False
    if not found:
        near = nearest(name, spare)
        raise BadInput(f"{where}: {name!r}: no such file" + (f"; there is {near!r}" if near else ""))
    if group and not is_hdf5(path.parent / name):
        raise BadInput(f"{where}: {name!r} has no group {group!r}: it is not an HDF5 file")
    return Address(path.parent / name, group)


def _check_log(log: Columns, system: System) -> None:
    """Refuse a log without a usable clock, or with a dead output."""
    faults = Faults()
    with faults.collected():
        check_time(log)
    for output in system.outputs:
        with faults.collected():
            _check_alive(log, output.column)
    faults.check()


def _check_alive(log: Columns, column: str) -> None:
    values = log.values[column]
    if len(values) and np.ptp(values) == 0.0:
        place = f"{log.path}: row {log.row(0)}: column {column}"
        raise BadInput(f"{place}: dead output, {values[0]:g} in every row")
    if len(values) and np.ptp(values) < SMALLEST:
        raise BadInput(
            f"{log.path}: row {log.row(0)}: column {column}: its values differ by no more than "
            f"{np.ptp(values):.3g}, too little to compute with: check the unit of the column"
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
    period: float,
    notes: list[str],
    provenance: dict[str, Any],
) -> Logs:
    ids = tuple(experiments["id"])
    clocks, moves = zip(*(uniform_clock(log.values["t"], period) for log in logs), strict=True)
    offsets = np.concatenate([[0], np.cumsum([len(clock) for clock in clocks])]).astype(np.int64)
    pairs = list(zip(logs, clocks, strict=True))
    y, u = np.empty((offsets[-1], len(system.outputs))), np.empty((offsets[-1], len(system.inputs)))
    notes = [*notes, *_moved(ids, moves, period)]
    for j, output in enumerate(system.outputs):
        columns = [log.values[output.column] for log in logs]
        turning = [output.unit.strip() == "rad" and _wrapped(column) for column in columns]
        columns = [np.unwrap(v) if turns else v for v, turns in zip(columns, turning, strict=True)]
        y[:, j] = _read(columns, pairs, "cubic")
        if any(turning):
            notes.append(f"{output.name} was unwrapped")
    for j, item in enumerate(system.inputs):
        u[:, j] = _read([log.values[item.column] for log in logs], pairs, "linear")
    return Logs.measurements(
        system,
        experiments=experiments,
        period=period,
        offsets=offsets,
        t=np.concatenate([period * np.arange(len(clock)) for clock in clocks]),
        y=y,
        u=u,
        notes=tuple(notes),
        provenance=provenance,
    )


def _wrapped(angle: Array) -> bool:
    """Whether `angle` (n,), rad, stays within one turn, jumps by a turn at times, and is smooth otherwise."""
    steps = np.diff(angle)
    jumps = np.abs(steps) > np.pi
    smooth = np.abs(np.remainder(steps + np.pi, TURN) - np.pi)
    # less than a quarter turn per sample, or a jump by a turn could as well be motion
    return bool(jumps.any() and smooth.max() < 0.5 * np.pi and np.ptp(angle) < TURN * (1.0 + 1e-3))


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
