"""Reading a log folder: experiments.csv and the logs that it names."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any

import numpy as np

from unmodelled.base.errors import BadInput, Faults, nearest
from unmodelled.base.limits import check_file
from unmodelled.base.shapes import ORIGIN, read_shaped
from unmodelled.logs.assembly import assembled, checked_in_si, units_of
from unmodelled.logs.constants import logged
from unmodelled.logs.hdf5 import Address, read_campaign, read_hdf5
from unmodelled.logs.logs import Logs
from unmodelled.logs.mapped import read_mapped
from unmodelled.logs.preparation import prepare, with_delays
from unmodelled.logs.recognition import Source
from unmodelled.logs.table import Columns, RawTable, TextTable, read_rows
from unmodelled.systems.given import SystemGiven, system_of
from unmodelled.systems.model import System

#: Span of time of a whole log, s.
EVERYTHING = -math.inf, math.inf


def read_logs(folder: Path | str, system: SystemGiven) -> Logs:
    """Read the experiments of a log folder, of recorders' files with a mapping, or of an HDF5 file.

    Args:
        folder: log folder with experiments.csv (one row per experiment: `id`, `file`, the operating point
            where the system file does not give it, optionally `group`, `t_from` and `t_to` in s for a part of
            a long log, anything else) and the CSV, Parquet or HDF5 files it names, with `t` in s and the
            columns of inputs and outputs. An optional provenance.json says where the data come from. Or a
            mapping, or a folder with mapping.yaml, that names the columns of recorders' files
            (`mapping.read_mapping`); an HDF5 file with a group per experiment (`hdf5.read_campaign`); a store
            that `Logs.write` wrote.
        system: system whose inputs and outputs name the columns, or the path of its file. A store must have
            been written for a system with the same inputs and outputs.

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
    folder, system = Path(folder), system_of(system)
    check_file(folder)
    if (mapped := read_mapped(folder, system)) is not None:
        return mapped
    faults, provenance = Faults(), dict[str, Any]()
    if folder.is_file():
        _check_campaign(folder)
        table, provenance = read_campaign(folder, logged(system))
    else:
        _check_folder(folder)
        if (folder / "experiments.parquet").exists() and not (folder / "experiments.csv").exists():
            return replace(prepare(system, _stored(folder, system)), source=str(folder))
        table = read_rows(folder / "experiments.csv", ["id", "file"])
    logs: list[Columns] = []
    with faults.collected():
        table, spans = _spans(table)
        logs = _logs(table, spans, system, faults)
    if not folder.is_file():
        with faults.collected():
            provenance = _provenance(folder)
    return replace(assembled(Logs, system, table, logs, provenance, faults), source=str(folder))


def _stored(folder: Path, system: System) -> Logs:
    """Read a store; its inputs act after the delays of `system`."""
    logs = Logs.read(folder, system)
    try:
        return with_delays(system, logs)
    except BadInput as error:
        raise BadInput(f"{folder}: {error}") from None


def _check_campaign(file: Path) -> None:
    """Refuse a file that cannot hold a campaign."""
    source, wanted = Source.of(file), "a folder with experiments.csv and the logs"
    if not source.is_hdf5:
        raise source.foreign(wanted) or BadInput(f"{file}: is a file, not {wanted}")


def _check_folder(folder: Path) -> None:
    """Refuse what is no folder, and a folder without a table of its logs."""
    try:
        if not folder.is_dir():
            raise BadInput(f"{folder}: no such folder")
        files = [path.name for path in folder.iterdir()]
    except OSError as error:
        raise BadInput(f"{folder}: cannot be read ({error.strerror})") from None
    if "experiments.csv" not in files and "experiments.parquet" not in files:
        near = nearest("experiments.csv", files)
        advice = "write one with a row (id, file) per log, or run: unmodelled init logs=<this folder>"
        advice = f"there is {near!r}: rename it" if near else advice
        raise BadInput(f"{folder / 'experiments.csv'}: no such file; {advice}")


def _spans(table: TextTable) -> tuple[TextTable, list[tuple[float, float]]]:
    """The table without the columns t_from and t_to, and the span of time of every row, s."""
    faults, ends = Faults(), []
    for name, none in zip(("t_from", "t_to"), EVERYTHING, strict=True):
        found: dict[int, float] = {}
        if name in table.header:
            filled = [each for each, cell in zip(table.rows, table.column(name), strict=True) if cell]
            with faults.collected():
                given = replace(table, rows=filled).numbers(name)
                found = dict(zip((row for row, _ in filled), given, strict=True))
        ends.append([found.get(row, none) for row, _ in table.rows])
    for (row, _), start, end in zip(table.rows, *ends, strict=True):
        if not start < end:
            late = f"must be after t_from = {start:g} s, got {end:g} s"
            faults.add(f"{table.path}: row {row}: column t_to: {late}")
    faults.check()
    kept = [k for k, name in enumerate(table.header) if name not in ("t_from", "t_to")]
    rows = [(row, [cells[k] for k in kept]) for row, cells in table.rows]
    return TextTable(table.path, [table.header[k] for k in kept], rows), list(zip(*ends, strict=True))


def _logs(
    table: TextTable, spans: Sequence[tuple[float, float]], system: System, faults: Faults
) -> list[Columns]:
    """The logs that the rows of a table name, cut to their spans of time, those with a fault left out."""
    units, path = units_of(system), table.path
    named = list(zip((row for row, _ in table.rows), table.column("file"), strict=True))
    files = {file.partition(":/")[0] for _, file in named}
    spare = sorted({each.name for each in path.parent.iterdir()} - {path.name, *files})
    sources: dict[Path, Source] = {}
    places = list[Address | BadInput]()
    for row, file in named:
        try:
            places.append(_place(path, row, file, spare, sources))
        except BadInput as error:  # is told below, in the order of the rows
            places.append(error)
    found = (place for place in places if isinstance(place, Address))
    packed = dict.fromkeys(place for place in found if sources[place.file].is_hdf5)
    read, logs = read_hdf5(list(packed), units, faults), []
    ended: dict[Address, float] = {}  # of the row before, if it names a part of the same log
    for (row, file), place, (start, end) in zip(named, places, spans, strict=True):
        with faults.collected():
            if isinstance(place, BadInput):
                raise place
            if place not in packed and place not in read:
                read[place] = RawTable(sources[place.file]).columns(list(units))
            if place in read:
                log = read[place] if (start, end) == EVERYTHING else read[place].between(start, end)
                if not len(log) and len(read[place]):
                    when = f"{start:g} s <= t < {end:g} s"
                    raise BadInput(f"{path}: row {row}: column t_from: {file!r} has no sample with {when}")
                log = checked_in_si(log, system)
                since = log.values["t"][0] - ended.get(place, np.inf)
                ended = {place: log.values["t"][-1]}
                logs.append(replace(log, since=since if since > 0.0 else None))
    return logs


def _place(path: Path, row: int, file: str, spare: Sequence[str], sources: dict[Path, Source]) -> Address:
    """The log that a row names, inside the folder; its file is added to `sources`, those that were looked at.

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
    place = Address(path.parent / name, group)
    source = sources.get(place.file) or Source.of(place.file)
    sources[place.file] = source
    if group and not source.is_hdf5:
        raise BadInput(f"{where}: {name!r} has no group {group!r}: it is not an HDF5 file")
    return place


def _provenance(folder: Path) -> dict[str, Any]:
    path = folder / "provenance.json"
    if not path.exists():
        return {"data": "measured", "description": f"log folder {folder.resolve().name}"}
    content: dict[str, Any] = read_shaped(path, ORIGIN)
    return content
