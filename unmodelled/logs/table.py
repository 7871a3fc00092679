"""Tables that a user hands over, CSV or Parquet, with every refusal naming row and column."""

from __future__ import annotations

import csv
import unicodedata
from array import array
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import chain, islice
from pathlib import Path

import numpy as np
import pandas as pd

from unmodelled.base.arrays import Array, Indices
from unmodelled.base.errors import BadInput, Faults
from unmodelled.base.extras import missing
from unmodelled.base.limits import NUMBERS, OBJECTS, check_file
from unmodelled.logs.cells import LARGEST, frame_columns, no_number, shown
from unmodelled.logs.recognition import NUMBER, Source, not_utf8, odd_row, reason, refuse_header

Records = Iterator[tuple[int, list[str]]]  # number of a row in the file, and its cells

#: No measurement in SI units varies by less; sizes below 1e-12 are not told from zero (`effects.scales`).
SMALLEST = 1e-15


@dataclass(frozen=True)
class Columns:
    """Columns of numbers of one file."""

    path: Path
    values: Mapping[str, Array]  # (samples,) by name, finite
    header: bool  # a CSV file, which has a row with names
    first: int = 0  # number of the first sample here in the file
    rows: Indices | None = None  # (samples,), rows of samples that were chosen from those of a file
    #: Time since the last sample of the log that this one continues, s; None: a record begins.
    since: float | None = field(default=None, kw_only=True)

    def __len__(self) -> int:
        return next((len(v) for v in self.values.values()), 0)

    def row(self, i: int) -> int:
        """Return the row of a sample: counted from 1, in a CSV file with the header and blank lines."""
        if self.rows is not None:
            return int(self.rows[i])
        i += self.first
        if not self.header:
            return i + 1
        lines = self.path.read_bytes().splitlines()
        return [number for number, line in enumerate(lines, 1) if line][i + 1]

    def between(self, start: float, end: float) -> Columns:
        """Return the part of a log from one time to another, s."""
        inside = np.flatnonzero((self.values["t"] >= start) & (self.values["t"] < end))
        return self.among(slice(int(inside[0]), int(inside[-1]) + 1) if len(inside) else slice(0, 0))

    def among(self, samples: slice) -> Columns:
        """Return some successive samples."""
        values = {name: column[samples] for name, column in self.values.items()}
        rows = None if self.rows is None else self.rows[samples]
        return replace(self, values=values, first=self.first + samples.start, rows=rows)


@dataclass(frozen=True)
class TextTable:
    """Rows of text below a header, as in experiments.csv."""

    path: Path
    header: list[str]
    rows: list[tuple[int, list[str]]]  # number of a row in the file, and its cells

    def column(self, name: str) -> list[str]:
        """Return the cells of a column."""
        at = self.header.index(name)
        return [cells[at] for _, cells in self.rows]

    def numbers(self, name: str) -> list[float]:
        """Return the finite numbers in a column."""
        found = _Column(self.path, name)
        for (row, _), cell in zip(self.rows, self.column(name), strict=True):
            found.add(row, cell)
        found.check()
        return found.values.tolist()


@dataclass(frozen=True)
class RawTable:
    """A CSV or Parquet file: its format and its header are read once, its cells when they are asked for."""

    source: Source

    @cached_property
    def _first(self) -> tuple[int, list[str]]:
        """The header, and the row in which it stands; none of an empty file."""
        if self.source.is_parquet:
            return 1, _parquet_names(self.source.path)
        return next(_records(self.source), (1, []))

    @property
    def header(self) -> list[str]:
        """Return the names of the columns; none of an empty file."""
        return self._first[1]

    def columns(self, names: Sequence[str]) -> Columns:
        """Read some columns."""
        path, wanted = self.source.path, list(dict.fromkeys(names))
        if self.source.is_parquet:
            check_header(path, self.header, wanted)
            return Columns(path, _parquet(path, wanted), header=False)
        check_file(path, NUMBERS)
        return Columns(path, _csv(self.source, _checked(path, self._first, wanted), wanted), header=True)


def read_columns(path: Path, names: Sequence[str]) -> Columns:
    """Read some columns of a CSV or Parquet file."""
    return RawTable(Source.of(path)).columns(names)


def read_rows(path: Path, wanted: Sequence[str]) -> TextTable:
    """Read header and rows of a CSV file as text, stripped; blank lines are skipped."""
    records = _records(Source.of(path, OBJECTS))
    return TextTable(path, _checked(path, next(records, (1, [])), wanted), list(records))


def check_header(path: Path, header: Sequence[str], wanted: Sequence[str]) -> None:
    """Refuse a header that repeats a column or lacks one that is wanted."""
    faults = Faults()
    with faults.collected():
        check_repeated(path, header)
    if not set(wanted) <= set(header):
        with faults.collected():
            refuse_header(path, header, wanted)
    faults.check()


def check_repeated(path: Path, header: Sequence[str]) -> None:
    """Refuse a header that repeats a column."""
    faults = Faults()
    for name, count in Counter(header).items():
        if name and count > 1 and not NUMBER.fullmatch(name):  # numbers: there is no header
            faults.add(f"{path}: row 1: column {shown(name)} stands there {count} times")
    faults.check()


class _Column:
    """Numbers of a column, read cell by cell, and what is none of them."""

    def __init__(self, path: Path, name: str) -> None:
        self.path, self.name, self.values = path, name, array("d")
        self._bad, self._first = 0, (0, "")

    def add(self, row: int, cell: str) -> None:
        """Read a cell."""
        if _is_number(cell):
            self.values.append(float(cell))
        else:
            self._first = self._first if self._bad else (row, cell)
            self._bad += 1

    def check(self) -> None:
        """Refuse the column if a cell was no number."""
        if self._bad:
            row, cell = self._first
            raise no_number(self.path, row, self.name, shown(cell), self._bad, _pointed(cell))


def _is_number(cell: str) -> bool:
    return bool(NUMBER.fullmatch(cell)) and abs(float(cell)) < LARGEST


def _pointed(cell: str) -> str:
    """Return advice on how to write a number with a decimal comma."""
    pointed = cell.replace(",", ".")
    return f": write {pointed[:30]}" if "," in cell and _is_number(pointed) else ""


def _records(source: Source) -> Records:
    path = source.path
    try:
        if other := source.foreign("a CSV table"):
            raise other
        with path.open(newline="", encoding="utf-8-sig") as file:
            reader = csv.reader(file)
            width = 0
            for cells in reader:
                width = width or len(cells)
                if cells and len(cells) != width:
                    raise BadInput(
                        f"{path}: row {reader.line_num}: must have {width} columns like row 1, "
                        f"got {len(cells)}{odd_row(cells)}"
                    )
                if cells:
                    yield reader.line_num, [cell.strip() for cell in cells]
    except UnicodeDecodeError:
        raise BadInput(f"{path}: not a table: {not_utf8(path)}") from None
    except (OSError, ValueError, csv.Error) as error:
        raise BadInput(f"{path}: {reason(error)}") from None


def check_texts(path: Path, experiments: pd.DataFrame, rows: Sequence[int]) -> None:
    """Refuse names of columns and cells that no terminal, page or figure can show."""
    for name in experiments.columns:
        if not is_text(str(name)):
            raise BadInput(f"{path}: row 1: column {shown(str(name))}: the name has a control character")
        for row, cell in zip(rows, experiments[name], strict=True):
            if isinstance(cell, str) and not is_text(cell):
                raise BadInput(
                    f"{path}: row {row}: column {name}: {shown(cell)} has a control character: leave it out"
                )


def is_text(text: str) -> bool:
    """Return whether all characters of a text are printable, or spaces of any width."""
    return all(c.isprintable() or unicodedata.category(c) == "Zs" for c in text)


def _checked(path: Path, first: tuple[int, list[str]], wanted: Sequence[str]) -> list[str]:
    """The header by its row and its names, if it has the wanted columns."""
    row, header = first
    if row != 1:  # blank rows come first
        header = [""]
    if not any(header):
        refuse_header(path, header, wanted)
    check_header(path, header, wanted)
    return header


def _csv(source: Source, header: Sequence[str], wanted: list[str]) -> dict[str, Array]:
    """Read with pandas; a file that pandas refuses is read cell by cell, which names the bad cells."""
    at = {name: header.index(name) for name in wanted}
    # other columns are read too, a byte of every cell, or rows of another length would not be noticed
    kinds = {k: np.float64 if name in wanted else "S1" for k, name in enumerate(header)}
    try:
        table = pd.read_csv(
            source.path,
            header=None,
            skiprows=1,
            dtype=kinds,
            keep_default_na=False,
            encoding="utf-8",
            compression=None,  # a text is one, whatever its ending says
        )
    except (ValueError, OSError):
        return _cell_by_cell(source, at)
    last = table.shape[1] - 1
    short = kinds.get(last) == "S1" and (table[last] == b"").any()
    if table.shape[1] == len(header) and not short:
        values = {name: table[k].to_numpy() for name, k in at.items()}
        if all((np.abs(v) < LARGEST).all() for v in values.values()):
            return values
    return _cell_by_cell(source, at)


def _cell_by_cell(source: Source, at: Mapping[str, int]) -> dict[str, Array]:
    """Columns of the records below the header, by their places in it."""
    path, records = source.path, islice(_records(source), 1, None)
    faults, found = Faults(), [_Column(path, name) for name in at]
    start = list(islice(records, 2))
    first = [start[0][1][k] for k in at.values()] if len(start) > 1 else []
    if first and not any(cell == "" or any(c.isdigit() for c in cell) for cell in first):
        got = ", ".join(map(shown, first))
        faults.add(f"{path}: row {start[0][0]}: must hold numbers, got {got}: delete the row")
        start = start[1:]
    for row, cells in chain(start, records):
        for k, column in zip(at.values(), found, strict=True):
            column.add(row, cells[k])
    for column in found:
        with faults.collected():
            column.check()
    faults.check()
    return {column.name: np.array(column.values) for column in found}


def _parquet_names(path: Path) -> list[str]:
    try:
        from unmodelled.base.parquet import read_schema
    except ModuleNotFoundError as error:
        raise BadInput(f"{path}: is a Parquet file: {missing(error) or error}, or save it as CSV") from None
    return list(read_schema(path).names)


def _parquet(path: Path, wanted: list[str]) -> dict[str, Array]:
    from unmodelled.base.parquet import read_parquet

    table = read_parquet(path, wanted)
    return frame_columns(path, {name: table[name] for name in wanted})
