"""Read text logs in which every line begins with the name of its message, as ArduPilot writes them."""

from __future__ import annotations

import csv
import io
import re
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pandas as pd

from unmodelled.base.limits import OBJECTS, check_file
from unmodelled.logs.readers.delimited import filled
from unmodelled.logs.readers.dialect import NAMED, NUMBER, is_value, split
from unmodelled.logs.readers.long import clock_of
from unmodelled.logs.readers.reader import START, Reader, Table
from unmodelled.logs.recognition import COMMENT

#: Messages that define others: names and columns, units of columns, symbols of units and of factors.
FORMAT, UNITS_OF, UNIT, FACTOR = DEFINING = "FMT", "FMTU", "UNIT", "MULT"
#: Letters of types that are written with their factor, and symbol of a column with the number of a sensor.
_SCALED, _INSTANCE = "cCeEL", "#"
#: Prefixes of units by factor; 0 is written for none.
_PREFIXES = {"1": "", "0": "", "0.01": "c", "0.001": "m", "1e-06": "u", "1e-09": "n", "1000": "k"}
#: Lines by which a file is recognised.
LINES = 4
#: Separators of cells: between others than commas, lines begin with a message's name and a time.
SEPARATORS = (",", ";", "\t", " ")
#: Checksum at the end of a line of NMEA 0183.
_CHECKSUM = re.compile(r"(?<=,)([^,*]*)\*[0-9A-Fa-f]{2}(?=\s*$)")


class Messages(Reader):
    """Reader of text logs: every message is a table, those of several sensors told apart by a number."""

    name = "message log"
    install = ""
    isolated = False

    def recognises(self, path: Path, start: bytes) -> bool:
        if b"\x00" in start:
            return False
        return _separator(start) is not None

    def read(self, path: Path, wanted: Sequence[str] | None) -> list[Table]:
        check_file(path, OBJECTS)
        kinds: dict[str, _Message] = {}
        with path.open("rb") as file:
            separator = _separator(file.read(START)) or ","
        with path.open(encoding="utf-8-sig", errors="replace", newline="") as file:
            for number, line in enumerate(file, start=1):
                name, comma, _ = line.strip().partition(separator)
                if comma and not line.lstrip().startswith(COMMENT):
                    message = kinds.setdefault(name.strip(), _Message(separator))
                    message.lines.append(_CHECKSUM.sub(r"\1", line) if line[0] in "$!" else line)
                    message.numbers.append(number)
        definitions = _Definitions.of(kinds)
        others = {k: v for k, v in kinds.items() if k not in DEFINING}
        return [
            part
            for name, message in others.items()
            for table in _tables(path, name, message, definitions)
            for part in _by_instance(table, definitions.instances.get(name))
        ]


@dataclass
class _Message:
    """Lines of one message, with their numbers in the file."""

    separator: str
    lines: list[str] = field(default_factory=list)
    numbers: list[int] = field(default_factory=list)


@dataclass(frozen=True)
class _Definitions:
    """Names and units of the columns of messages, and the columns that number the sensors."""

    columns: Mapping[str, Sequence[str]]
    units: Mapping[str, Mapping[str, str]]
    instances: Mapping[str, str]

    @classmethod
    def of(cls, kinds: Mapping[str, _Message]) -> _Definitions:
        """Return what the messages FMT, FMTU, UNIT and MULT of a file say."""

        def cells(name: str) -> list[list[str]]:
            return [split(line, ",") for line in kinds[name].lines] if name in kinds else []

        formats = {row[1]: row for row in cells(FORMAT) if len(row) > 5}
        columns = {row[3]: [c for cell in row[5:] for c in cell.split(",")] for row in formats.values()}
        labels = {_symbol(row[2]): row[3] for row in cells(UNIT) if len(row) > 3}
        factors = {_symbol(row[2]): row[3] for row in cells(FACTOR) if len(row) > 3}
        units, instances = dict[str, Mapping[str, str]](), dict[str, str]()
        for row in cells(UNITS_OF):
            if len(row) < 5 or row[2] not in formats:
                continue
            name, types = formats[row[2]][3], formats[row[2]][4]
            symbols = list(zip(columns[name], types, row[3], row[4].ljust(len(row[3]), "-"), strict=False))
            known = {c: _unit(labels.get(u, ""), kind, factors.get(m, "1")) for c, kind, u, m in symbols}
            units[name] = {column: unit for column, unit in known.items() if unit}
            numbers = [column for column, _, symbol, _ in symbols if symbol == _INSTANCE]
            if numbers:
                instances[name] = numbers[0]
        return cls(columns, units, instances)


def _symbol(cell: str) -> str:
    """A symbol, which may be written as the number of its letter."""
    return chr(int(cell)) if cell.isdecimal() and 31 < int(cell) < 127 else cell


def _unit(label: str, kind: str, factor: str) -> str:
    """The unit of a column; "" if its factor makes no unit of it."""
    try:
        prefix = "" if kind in _SCALED else _PREFIXES.get(f"{float(factor):g}")
    except ValueError:
        prefix = ""
    return f"{prefix}{label}" if label and prefix is not None else ""


def _separator(start: bytes) -> str | None:
    """The separator of the cells of messages, by the first bytes of their file; None for another file."""
    lines = start.decode("utf-8-sig", "replace").splitlines()[:-1]
    lines = [line for line in lines if line.strip() and not line.lstrip().startswith(COMMENT)]
    for separator in SEPARATORS:
        kinds = _kinds(lines, separator)
        if (separator == "," and FORMAT in kinds) or (_differ(kinds) and (separator == "," or _timed(kinds))):
            return separator
    return None


def _timed(kinds: Mapping[str, list[list[str]]]) -> bool:
    """Whether a time that grows stands behind the name of every message that is written often.

    It may have its name before it: `t=1.5`.
    """
    often = [[_bare(row[0]) for row in rows[-LINES:]] for rows in kinds.values() if len(rows) >= LINES]
    numbers = [float(cell) for cells in often for cell in cells if NUMBER.fullmatch(cell)]
    steps = np.diff(np.reshape(numbers, (-1, LINES))) if len(numbers) == LINES * len(often) else np.zeros(1)
    return bool((steps >= 0.0).all() and steps.any())


def _bare(cell: str) -> str:
    """A cell without the name of its number."""
    named = NAMED.fullmatch(cell)
    return named[2] if named else cell


def _kinds(lines: Sequence[str], separator: str) -> dict[str, list[list[str]]]:
    """The cells of lines behind their first one, by that one if it is a word."""
    found: dict[str, list[list[str]]] = {}
    for line in lines:
        try:
            name, *cells = split(line, separator)
        except (ValueError, csv.Error):
            return {}
        if not cells or not name or is_value(name):
            return {}
        found.setdefault(name, []).append(cells)
    return found


def _differ(kinds: Mapping[str, list[list[str]]]) -> bool:
    """Whether lines are those of messages: each of one width, mostly of values, and not all of one width."""
    often = [rows for rows in kinds.values() if len(rows) >= LINES]
    widths = [{len(row) for row in rows} for rows in often]
    values = [is_value(cell) for rows in often for row in rows[1:] for cell in row]
    own = [not any(map(is_value, rows[0])) and any(map(is_value, rows[1])) for rows in often]
    return (
        len(often) > 1
        and all(len(width) == 1 for width in widths)
        and (len(set.union(*widths)) > 1 or all(own))
        and sum(values) > 0.5 * len(values)
    )


def _tables(path: Path, name: str, message: _Message, definitions: _Definitions) -> list[Table]:
    """The table of a message, if its lines hold values."""
    cells = [split(line, message.separator)[1:] for line in message.lines[:2]]
    columns = list(definitions.columns.get(name, ()))
    lines, numbers = message.lines, message.numbers
    if not columns and len(cells) > 1 and not any(map(is_value, cells[0])) and any(map(is_value, cells[1])):
        columns, lines, numbers = cells[0], lines[1:], numbers[1:]
    columns = columns or [str(k) for k in range(1, len(cells[0]) + 1)]
    fresh = [each and each not in columns[:k] for k, each in enumerate(columns)]
    named = [
        each if new else f"{each}#{k}" for k, (each, new) in enumerate(zip(columns, fresh, strict=True), 1)
    ]
    with warnings.catch_warnings(action="ignore", category=pd.errors.ParserWarning):  # commas in a last text
        frame = pd.read_csv(
            io.StringIO("".join(lines)),
            sep=r"\s+" if message.separator == " " else message.separator,
            header=None,
            names=["", *named],
            index_col=False,
            skipinitialspace=True,
            low_memory=False,
            quoting=csv.QUOTE_NONE,
        ).iloc[:, 1:]
    empty = Table(name, {}, definitions.units.get(name, {}), rows=np.asarray(numbers[: len(frame)]))
    return [replace(table, clock=clock_of(table)) for table in filled(path, empty, frame, ".")]


def _by_instance(table: Table, column: str | None) -> list[Table]:
    """The tables of several sensors: `IMU`, `IMU_1`."""
    if column is None or column not in table.columns:
        return [table]
    values = table.columns[column]
    known = np.unique(values[np.isfinite(values)])
    if len(known) < 2:
        return [table]
    parts = [(f"{number:g}", np.flatnonzero(values == number)) for number in known.tolist()]
    return [table.among(f"{table.name}_{k}" if k != "0" else table.name, rows) for k, rows in parts]
