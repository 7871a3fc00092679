"""Logs from a recorder's files, by a mapping of their columns to the signals of a system."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from unmodelled.base.arrays import Array, Indices
from unmodelled.base.errors import BadInput, Faults, closest
from unmodelled.logs.assembly import assembled, checked_in_si
from unmodelled.logs.cells import shown
from unmodelled.logs.clock import SHORTEST_LOG
from unmodelled.logs.constants import logged
from unmodelled.logs.logs import Logs
from unmodelled.logs.mapping import ByFile, Column, LogMapping, mapping_of, read_mapping
from unmodelled.logs.readers.known import read_files
from unmodelled.logs.readers.reader import Table
from unmodelled.logs.record import (
    LATEST,
    NAMES,
    Found,
    Record,
    check_coarse,
    from_start,
    in_groups,
    in_order,
    parts_of,
)
from unmodelled.logs.signals import Channel, as_written, channels_of, leading
from unmodelled.logs.table import Columns, TextTable
from unmodelled.systems.model import System

#: Characters of a cell that name a part of a record; a number tells parts apart whose names are equal so far.
LONGEST = 100
#: Cells of a column (rows,), as text.
Texts = NDArray[np.object_]
#: Cells of an experiment in the table (id, file and constants of the mapping), and its log.
_Experiment = tuple[list[str], Columns]


def read_mapped(place: Path, system: System) -> Logs | None:
    """Read the experiments that a mapping describes."""
    path = mapping_of(place)
    if path is None:
        return None
    mapping = read_mapping(path)
    channels = channels_of(system, mapping)
    _check_constants(mapping, system)
    faults, told = Faults(), Counter[str]()
    paths = mapping.paths()
    read = read_files(list(paths.values()), None if mapping.groups else _wanted(mapping, channels), faults)
    records: dict[str, Record] = {}
    for name, file in paths.items():
        if file in read:
            with faults.collected():
                records |= _records(name, file, read[file], mapping, len(paths))
    found: list[_Experiment] = []
    for name, record in records.items():
        with faults.collected():
            found += _experiments(name, record, channels, told, len(records))
    logs: list[Columns] = []
    for _, log in found:
        with faults.collected():
            logs.append(checked_in_si(log, system))
    if not found:
        faults.check()
    rows = list(enumerate((cells for cells, _ in found), start=1))
    table = TextTable(Path(f"{path}: experiments"), ["id", "file", *mapping.constants], rows)
    origin = {"data": "measured", "description": f"mapping {path.name} in {path.resolve().parent.name}"}
    units = {record.unit for record in records.values()}
    clock = units.pop() if len(units) == 1 else "s"
    logs_of = assembled(Logs, system, table, logs, origin, faults, mapping.cure, clock)
    notes = [f"{text}: {count}" if count else text for text, count in told.items()]
    return replace(logs_of, notes=(*notes, *logs_of.notes), source=str(place))


def _records(
    name: str, file: Path, tables: Sequence[Table], mapping: LogMapping, files: int
) -> dict[str, Record]:
    """The records in a file, by id: the file, or those of its groups that are experiments."""
    if not mapping.groups:
        return {name: Record(file, tables, mapping)}
    groups = in_groups(tables, mapping.groups)
    if not groups:
        listed = ", ".join(dict.fromkeys(repr(table.name) for table in tables[:NAMES]))
        raise mapping.node.entries()["groups"].wrong(f"{file} has no such group; it has {listed}")
    short = [group.rsplit("/", 1)[-1] for group in groups]
    ids = short if len(set(short)) == len(short) else [group.replace("/", "-") for group in groups]
    return {
        label if files == 1 else f"{name}-{label}": Record(Path(f"{file}:/{group}"), inside, mapping)
        for label, (group, inside) in zip(ids, groups.items(), strict=True)
    }


def _check_constants(mapping: LogMapping, system: System) -> None:
    for name in logged(system):
        if name not in mapping.constants:
            where = mapping.node.entries().get("constants", mapping.node)
            raise where.wrong(
                f"the constant {name!r} of the system file is missing{closest(name, mapping.constants)}: "
                f"write 'constants: {{{name}: ...}}' with a number, {{column: ...}} or {{files: ...}}"
            )


def _wanted(mapping: LogMapping, channels: Sequence[Channel]) -> list[str]:
    columns = [channel.signal.column for channel in channels]
    columns += [column for column in mapping.constants.values() if isinstance(column, Column)]
    columns += [mapping.split_by] if mapping.split_by else []
    columns += [mapping.time.column] if mapping.time and mapping.time.column else []
    return [column.name for column in columns]


def _experiments(
    name: str, record: Record, channels: Sequence[Channel], told: Counter[str], files: int
) -> list[_Experiment]:
    """The experiments in one file: its parts with equal values of a column, cut to length."""
    channels, on_change = as_written(record, channels)
    if on_change:
        how = "is" if len(on_change) == 1 else "are"
        told.setdefault(f"{', '.join(on_change)} {how} written on change; if not, write 'hold: false'", 0)
    first = leading(channels)
    base, values = record.numbers(first.signal.column)
    t = record.clock(base.table)
    told.update(dict.fromkeys(sorted(record.assumed), 0))
    usable = np.flatnonzero(np.isfinite(t) & base.entries(values, first.signal.column.hold))
    if not len(usable):
        column = record.mapping.time.column if record.mapping.time else None
        node = column.node if column else first.signal.column.node
        raise node.wrong(
            f"{record.path}: no row has a time below {LATEST:g} s and a value of {first.item.name}: "
            "check the columns, and the unit of the time"
        )
    unusable = len(t) - len(usable)
    _tell(told, f"rows without a time or a value of {first.item.name}, left out", unusable)
    _tell_words(record, channels, told)
    found = []
    for label, rows in _split(name, record, base, t, usable, files, told):
        ordered, late, repeated = in_order(t, rows, first.signal.column.hold)
        check_coarse(str(record.path), repeated, len(rows))
        _tell(told, "rows out of order, sorted by time", late)
        _tell(told, "rows that repeat a time stamp, left out", repeated)
        log = _log(record, channels, base, t, ordered, told)
        constants = record.mapping.constants.values()
        described = [_described(record, base, ordered, t, column) for column in constants]
        cut = _cut(label, log, record.mapping.cut, told)
        found += [([part, str(each.path), *described], each) for part, each in cut]
    return found


def _split(
    name: str, record: Record, base: Found, t: Array, rows: Indices, files: int, told: Counter[str]
) -> list[tuple[str, Indices]]:
    """Parts of a file with their ids: runs of equal values of a column, and where time starts again."""
    parts = [(name, rows)]
    column = record.mapping.split_by
    if column is not None:
        found = record.find(column)
        if len(found.table) != len(base.table):
            raise column.node.wrong(
                f"{record.path}: {column.name!r} must be in the table of the first output, "
                f"{base.table.name!r}"
            )
        cells = _texts(found)
        ends = [0, *(np.flatnonzero(cells[rows][1:] != cells[rows][:-1]) + 1), len(rows)]
        every = [rows[a:b] for a, b in pairwise(ends) if b > a]
        # a run that was broken off is no reason to refuse the others
        runs = [run for run in every if len(run) >= SHORTEST_LOG] or every
        short = f"runs of {column.name!r} with fewer than {SHORTEST_LOG} samples, left out"
        _tell(told, short, len(every) - len(runs))
        of = [str(cells[run[0]])[:LONGEST] for run in runs]
        parts = [(f"{name}-{part}" if files > 1 else part, run) for part, run in zip(of, runs, strict=True)]
    again = [(label, part) for label, run in parts for part in parts_of(t, run)]
    _tell(told, "starts of time within a file, where another experiment begins", len(again) - len(parts))
    labels = [label for label, _ in again]
    return [
        (label if labels.count(label) == 1 else f"{label}-{labels[: k + 1].count(label)}", part)
        for k, (label, part) in enumerate(again)
    ]


def _log(
    record: Record, channels: Sequence[Channel], base: Found, t: Array, rows: Indices, told: Counter[str]
) -> Columns:
    """The signals of one experiment at the instants of the first output, or at uniform ones if all hold."""
    instants = t[rows]
    if leading(channels).signal.column.hold:
        instants = np.linspace(t[rows[0]], t[rows[-1]], len(rows))
        rate = f"every {instants[1] - instants[0]:.4g} s, as often as {base.name} is written on average"
        told.setdefault(f"signals that hold from row to row were read {rate}", 0)
    others = [channel.series(record, base, t, rows, instants) for channel in channels]
    inside = np.all([np.isfinite(values) for values, _ in others], axis=0)
    for channel, (_, how) in zip(channels, others, strict=True):
        if how:
            told.setdefault(f"{channel.item.name} {how}", 0)
    missed = int(np.count_nonzero(~inside))
    _tell(told, "rows at which a signal of another clock has no value, left out", missed)
    if not inside.any():
        raise BadInput(f"{record.path}: its signals have no time in common: check the clocks of their tables")
    values = {"t": from_start(instants[inside])}
    values |= {c.item.column: found[inside] for c, (found, _) in zip(channels, others, strict=True)}
    place = Path(f"{record.path}:{base.table.name}") if base.table.name else record.path
    before = rows[np.searchsorted(t[rows], instants[inside], "right") - 1]
    return Columns(place, values, header=False, rows=base.table.numbered(before))


def _cut(name: str, log: Columns, length: float | None, told: Counter[str]) -> list[tuple[str, Columns]]:
    """Parts of equal length, without a rest that is too short for an experiment."""
    t = log.values["t"]
    if length is None or t[-1] < 2.0 * length:
        return [(name, log)]
    parts = list[tuple[str, Columns]]()
    with np.errstate(over="ignore", invalid="ignore"):
        end, part = -np.inf, np.floor(t / length + 1e-9)
        edges = np.flatnonzero(np.diff(part)) + 1
    for rows in np.split(np.arange(len(t)), edges):
        if len(rows) < SHORTEST_LOG or t[rows[-1]] - t[rows[0]] < 0.5 * length:
            _tell(told, "rests of less than half the length of a cut, left out", 1)
            continue
        cut = log.among(slice(rows[0], rows[-1] + 1))
        since, end = t[rows[0]] - end if parts else None, t[rows[-1]]
        cut = replace(cut, values={**cut.values, "t": t[rows] - t[rows[0]]}, since=since)
        parts.append((f"{name}-{int(part[rows[0]]) + 1}", cut))
    if not parts:
        raise BadInput(
            f"{log.path}: cut: {length:g} s hold fewer than {SHORTEST_LOG} samples: cut longer parts"
        )
    return parts


def _described(record: Record, base: Found, rows: Indices, t: Array, column: Column | ByFile | str) -> str:
    """The one value that a constant has during an experiment, as text."""
    if isinstance(column, str):
        return column
    if isinstance(column, ByFile):
        return column.of(record.path)
    found = record.find(column)
    cells = _texts(found)
    if column.hold or (found.table.clock is not None and len(found.table) != len(base.table)):
        cells = _during(cells, record.clock(found.table), t[rows[[0, -1]]])
    elif len(found.table) == len(base.table):
        cells = cells[rows]
    values = list(dict.fromkeys(cells[cells != ""].tolist()))
    if len(values) != 1:
        got = f"it changes from {values[0]} to {values[1]}" if values else "it is empty"
        raise column.node.wrong(f"{record.path}: {column.name!r} must keep one value in an experiment, {got}")
    return str(values[0])


def _during(cells: Texts, clock: Array, ends: Array) -> Texts:
    """The cells (rows,) that hold between two instants `ends`, s, the one from before among them."""
    filled = np.flatnonzero((cells != "") & np.isfinite(clock))
    order = filled[np.argsort(clock[filled], kind="stable")]
    first, last = np.searchsorted(clock[order], ends, "right") - 1
    return cells[order][max(first, 0) : max(last, 0) + 1]


def _texts(found: Found) -> Texts:
    """The cells of a column as text, numbers as short as they are exact; "" where there is none.

    Equal cells are one object, or a text in every row would take its length times the rows.
    """
    if found.numbers is None:
        cells = found.table.texts[found.name]
        known = {cell: re.sub(r"\s+", " ", str(cell)).strip() for cell in dict.fromkeys(cells)}
        return np.array([known[cell] for cell in cells], object)
    return np.array(["" if np.isnan(v) else _shortest(float(v)) for v in found.numbers], object)


def _shortest(value: float) -> str:
    short = f"{value:g}"
    return short if float(short) == value else repr(value)


def _tell_words(record: Record, channels: Sequence[Channel], told: Counter[str]) -> None:
    """Count the words among the numbers of signals that hold, for notes."""
    for channel in (each for each in channels if each.signal.column.hold):
        found = record.find(channel.signal.column)
        for word, count in Counter(found.words.values()).most_common(NAMES):
            name = channel.item.name
            _tell(told, f"rows in which {name} is {shown(word)}, missing until its next number", count)


def _tell(told: Counter[str], text: str, count: int) -> None:
    """Count what was done to the data, for a note."""
    if count:
        told[text] += count
