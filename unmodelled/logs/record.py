"""One file of a recorder: finding columns in its tables, their clocks, and series of numbers over time."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np

from unmodelled.base.arrays import Array, Indices, Mask
from unmodelled.base.errors import BadInput, first_few, nearest
from unmodelled.logs.cells import LARGEST
from unmodelled.logs.clock import SHORTEST_LOG
from unmodelled.logs.mapping import Column, LogMapping
from unmodelled.logs.readers.names import PUBLISHER
from unmodelled.logs.readers.reader import Table
from unmodelled.logs.time_units import clock_unit, in_seconds, seconds_of, unit_of_time

#: Time stamps of recorders are below, s, also those that count from 1970.
LATEST = 1e11
#: Share of equal time stamps from which on the clock is too coarse for its samples.
COARSE = 0.25
#: Share of a sampling period below which two time stamps are equal.
TOGETHER = 0.01
#: Names of columns that a message shows.
NAMES = 8


@dataclass(frozen=True)
class Found:
    """A column of a file: its table, and its name there."""

    table: Table
    name: str

    @property
    def numbers(self) -> Array | None:
        """Numbers of the column (rows,); None for a column of text."""
        return self.table.columns.get(self.name)

    @property
    def unit(self) -> str | None:
        """Unit as the file writes it; None where it has none."""
        return self.table.units.get(self.name)

    @property
    def words(self) -> Mapping[int, str]:
        """Words among the numbers of the column, such as "unavailable", by row."""
        return self.table.words.get(self.name, {})

    def entries(self, values: Array, hold: bool) -> Mask:
        """Return whether rows (rows,) count: those with a finite value, and words that end one that holds."""
        known = np.isfinite(values)
        known[list(self.words) if hold else []] = True
        return known


class Record:
    """One file, or one folder of files that belong together."""

    def __init__(self, path: Path, tables: Sequence[Table], mapping: LogMapping) -> None:
        self.path, self.tables, self.mapping = path, tables, mapping
        self.assumed: set[str] = set()
        self.unit = "s"  # of the clock that was read last

    def find(self, column: Column) -> Found:
        """Return a column by its name with its table, or alone where only one table has it."""
        for alone in (False, True):
            found = [at for table in self.tables if (at := _in(table, column.name, alone))]
            if len(found) == 1:
                return found[0]
            if found:
                places = ", ".join(repr(at.table.address(at.name)) for at in found[:NAMES])
                raise column.node.wrong(
                    f"{column.name!r} is in several tables of {self.path}: write {places}"
                )
        every = ((table, name) for table in self.tables for name in (*table.columns, *table.texts))
        names = [table.address(name) for table, name in every]
        near = nearest(column.name, names)
        told = f"did you mean {near!r}?" if near else f"it has {first_few([*map(repr, names)], NAMES)}"
        raise column.node.wrong(f"{self.path} has no column {column.name!r}; {told}")

    def numbers(self, column: Column) -> tuple[Found, Array]:
        """Return a column of numbers, and these (rows,)."""
        found = self.find(column)
        if found.numbers is None:
            cell = str(found.table.texts[found.name][0])[:30]
            raise column.node.wrong(f"{self.path}: column {column.name!r} holds text such as {cell!r}")
        # beyond any measurement is no number, as in a tidy log
        return found, np.where(np.abs(found.numbers) < LARGEST, found.numbers, np.nan)

    def clock(self, table: Table) -> Array:
        """Return the time of every row (rows,) of a table, s."""
        t = self._stamps(table)
        return np.where(np.abs(t) < LATEST, t, np.nan)

    def _stamps(self, table: Table) -> Array:
        time = self.mapping.time
        if time is None:
            if table.clock is None:
                what = f"table {table.name!r} of {self.path}" if table.name else str(self.path)
                raise self.mapping.node.wrong(
                    f"the key 'time' is missing: {what} has no clock of its own; write "
                    "'time: {column: ..., unit: s}' or 'time: {rate: 100 Hz}'"
                )
            return table.clock
        if time.period is not None:
            return time.period * np.arange(len(table), dtype=np.float64)
        assert time.column is not None
        own = _in(table, time.column.name, True)
        found, t = (own, own.numbers) if own else self.numbers(time.column)
        if t is None:
            found, t = self.numbers(time.column)
        if len(t) != len(table):
            raise time.column.node.wrong(
                f"{self.path}: {time.column.name!r} has {len(t)} rows, and table {table.name!r} has "
                f"{len(table)}: name a column that every table has"
            )
        seconds = time.seconds if time.seconds is not None else seconds_of(found.unit or "")
        if seconds is None and (unit := unit_of_time(f"{found.name} {found.unit or ''}", t)):
            seconds = seconds_of(unit)
            if unit != "s":
                self.assumed.add(f"time {found.name} was read in {unit}, by its name or its numbers")
        self.unit = clock_unit(seconds)
        return t if seconds is None else in_seconds(t, seconds)


def _in(table: Table, name: str, alone: bool) -> Found | None:
    """A column of a table by its address in the file, or by its name alone."""
    if not alone and table.name:
        topic = table.name.partition(PUBLISHER)[0]  # enough, if one publisher has the column
        prefix = next((each for each in (table.name, topic) if name.startswith(f"{each}.")), None)
        if prefix is None:
            return None
        name = name[len(prefix) + 1 :]
    if name in table.columns or name in table.texts:
        return Found(table, name)
    return Found(table, table.aliases[name]) if name in table.aliases else None


def parts_of_name(name: str) -> list[str]:
    """Return the groups in which a table lies, from the outermost to the table itself: `runs[0]`, `motor`."""
    return [part for part in re.split(r"[/.]", name) if part]


def in_groups(tables: Sequence[Table], patterns: Sequence[str]) -> dict[str, list[Table]]:
    """Return the tables of every group that a pattern matches, named as seen from that group."""
    wanted = [pattern.strip("/").split("/") for pattern in patterns]
    found: dict[str, list[Table]] = {}
    for table in tables:
        parts = parts_of_name(table.name)
        for pattern in wanted:
            head, rest = parts[: len(pattern)], parts[len(pattern) :]
            if len(head) == len(pattern) and all(map(fnmatchcase, head, pattern)):
                found.setdefault("/".join(head), []).append(replace(table, name="/".join(rest)))
                break
    return found


def from_start(t: Array) -> Array:
    """Return the time (samples,), s, since the first sample, without digits that the clock does not hold.

    Examples:
        >>> from_start(np.array([1764041247.01, 1764041247.02])).tolist()
        [0.0, 0.01]
    """
    digits = int(np.floor(-np.log10(max(4.0 * np.spacing(np.abs(t).max()), 1e-12))))
    plain = np.round(t - t[0], digits)
    return np.asarray(plain if np.all(np.diff(plain) > 0.0) else t - t[0])


def parts_of(t: Array, rows: Indices) -> list[Indices]:
    """Return the parts (rows,) of a record in which time does not start again."""
    parts, start = [], 0
    back = np.flatnonzero(np.diff(t[rows]) < 0.0) + 1
    for at in back:
        if at - start >= SHORTEST_LOG and t[rows[at]] <= t[rows[start]]:
            parts.append(rows[start:at])
            start = int(at)
    return [*parts, rows[start:]]


def in_order(t: Array, rows: Indices, hold: bool = False) -> tuple[Indices, int, int]:
    """Return rows (rows,) in the order of time, of equal stamps the last; and how many were late or equal.

    Stamps are equal if they are less than a hundredth of a sampling period apart: messages that were held up
    arrive together, and a curve through all of them would be steep. The last of them is the least late.
    Of values that hold, only equal stamps are: they have no period, and a short pulse counts.
    """
    late = int(np.count_nonzero(np.diff(t[rows]) < 0.0))
    ordered = rows[np.argsort(t[rows], kind="stable")] if late else rows
    steps = np.diff(t[ordered])
    new = steps > 0.0
    apart = steps > TOGETHER * np.median(steps[new]) if new.any() and not hold else new
    if np.count_nonzero(~apart) <= COARSE * len(rows):  # otherwise bursts are how the recorder writes
        new = apart
    last = np.concatenate([new, [True]])
    return ordered[last], late, int(np.count_nonzero(~last))


def check_coarse(where: str, repeated: int, count: int) -> None:
    """Refuse a clock that is too coarse for its samples."""
    if repeated > COARSE * count:
        raise BadInput(
            f"{where}: {repeated} of {count} rows repeat a time stamp: the clock is too coarse, or the wrong "
            "column; if the samples are uniform, write 'time: {rate: 100 Hz}' with their rate in the mapping"
        )
