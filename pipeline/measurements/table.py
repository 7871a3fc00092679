"""Tables that a user hands over, CSV or Parquet, with every refusal naming row and column."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv as pa_csv
import pyarrow.parquet as pq
from numpy.typing import NDArray

from pipeline.errors import BadInput
from pipeline.parquet import read_arrow

Array = NDArray[np.float64]
Rows = list[tuple[int, list[str]]]  # row number in the file, cells

#: No measurement is larger, and squares of what is smaller do not overflow.
LARGEST = 1e100
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)


@dataclass(frozen=True)
class Columns:
    """Columns of numbers of one file.

    Attributes:
        path: of the file.
        values: name -> (n,) finite numbers.
        parquet: whether the file is a Parquet file, which has no header row.
    """

    path: Path
    values: Mapping[str, Array]
    parquet: bool

    def __len__(self) -> int:
        return next((len(v) for v in self.values.values()), 0)

    def row(self, i: int) -> int:
        """The row of sample `i`: counted from 1, in a CSV file with the header and blank lines."""
        if self.parquet:
            return i + 1
        lines = self.path.read_bytes().splitlines()
        return [number for number, line in enumerate(lines, 1) if line][i + 1]


def read_columns(path: Path, names: Sequence[str]) -> Columns:
    """The columns `names` of a CSV or Parquet file.

    Raises:
        BadInput: when the file is missing, no table, or lacks or repeats a column, or when a cell in one of
            them is not a finite number.
    """
    wanted = list(dict.fromkeys(names))
    try:
        with path.open("rb") as file:
            parquet = file.read(4) == b"PAR1"
    except (OSError, ValueError) as error:
        raise BadInput(f"{path}: {_reason(error)}") from None
    return Columns(path, _parquet(path, wanted) if parquet else _csv(path, wanted), parquet)


def read_rows(path: Path) -> tuple[list[str], Rows]:
    """Header and rows of a CSV file as text, stripped; blank lines are skipped.

    Raises:
        BadInput: when the file is missing or no table, or a row has another number of cells than the header.
    """
    rows = _records(path)
    number, header = next(rows, (1, []))
    if number != 1 or not any(header):
        raise BadInput(f"{path}: row 1: must name the columns")
    return header, list(rows)


def check_header(path: Path, header: Sequence[str], wanted: Sequence[str]) -> None:
    """Refuse a header that repeats a column or lacks one of `wanted`.

    Raises:
        BadInput: naming the column.
    """
    for name, count in Counter(header).items():
        if name and count > 1:
            raise BadInput(f"{path}: row 1: column {_shown(name)} stands there {count} times")
    for name in wanted:
        if name not in header:
            raise BadInput(f"{path}: row 1: column {name} is missing")


def number(path: Path, row: int, column: str, cell: str) -> float:
    """The finite number in a cell.

    Raises:
        BadInput: when there is none, or it is beyond any measurement.
    """
    if NUMBER.fullmatch(cell) and abs(value := float(cell)) < LARGEST:
        return value
    raise _no_number(path, row, column, _shown(cell))


def _no_number(path: Path, row: int, column: str, cell: str) -> BadInput:
    return BadInput(f"{path}: row {row}: column {column}: {cell} is not a finite number below {LARGEST:g}")


def _records(path: Path) -> Iterator[tuple[int, list[str]]]:
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            reader = csv.reader(file)
            width = 0
            for cells in reader:
                width = width or len(cells)
                if cells and len(cells) != width:
                    raise BadInput(
                        f"{path}: row {reader.line_num}: must have {width} columns like row 1, "
                        f"got {len(cells)}"
                    )
                if cells:
                    yield reader.line_num, [cell.strip() for cell in cells]
    except (OSError, ValueError, csv.Error) as error:
        raise BadInput(f"{path}: {_reason(error)}") from None


def _reason(error: Exception) -> str:
    if isinstance(error, FileNotFoundError):
        return "no such file"
    if isinstance(error, OSError):
        return f"cannot be read ({error.strerror})"
    return f"not a table ({' '.join(str(error).split())})"


def _csv(path: Path, wanted: list[str]) -> dict[str, Array]:
    """Arrow reads quickly; what it does not take is read cell by cell, which names the first bad one."""
    number_, header = next(_records(path), (1, []))
    if number_ != 1 or not any(header):
        raise BadInput(f"{path}: row 1: must name the columns")
    check_header(path, header, wanted)
    try:
        table = pa_csv.read_csv(
            path,
            read_options=pa_csv.ReadOptions(column_names=header, skip_rows=1),
            convert_options=pa_csv.ConvertOptions(
                include_columns=wanted, column_types=dict.fromkeys(wanted, pa.float64()), null_values=[]
            ),
        )
    except (pa.ArrowException, OSError):
        return _cell_by_cell(path, wanted)
    values = {name: table[name].to_numpy() for name in wanted}
    fine = all((np.abs(v) < LARGEST).all() for v in values.values())
    return values if fine else _cell_by_cell(path, wanted)


def _cell_by_cell(path: Path, wanted: list[str]) -> dict[str, Array]:
    header, rows = read_rows(path)
    at = [(name, header.index(name)) for name in wanted]
    numbers = [[number(path, row, name, cells[k]) for name, k in at] for row, cells in rows]
    columns = np.array(numbers, np.float64).reshape(-1, len(wanted)).T
    return dict(zip(wanted, columns, strict=True))


def _parquet(path: Path, wanted: list[str]) -> dict[str, Array]:
    try:
        check_header(path, pq.read_schema(path).names, wanted)
    except (pa.ArrowException, OSError) as error:
        raise BadInput(f"{path}: not a table ({str(error).splitlines()[0]})") from None
    table = read_arrow(path, wanted)
    return {name: _numbers(path, name, table[name]) for name in wanted}


def _numbers(path: Path, name: str, column: pa.ChunkedArray) -> Array:
    kind = column.type
    if not (pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_decimal(kind)):
        cell = _shown(str(column[0].as_py())) if len(column) else str(kind)
        raise _no_number(path, 1, name, cell)
    values = np.asarray(column.cast(pa.float64(), safe=False).to_numpy(), np.float64)
    bad = np.flatnonzero(~(np.abs(values) < LARGEST))
    if len(bad):
        cell = column[int(bad[0])].as_py()
        shown = "an empty cell" if cell is None else str(cell)
        raise _no_number(path, int(bad[0]) + 1, name, shown)
    return values


def _shown(text: str) -> str:
    """A user's text on one line."""
    return repr(text[:30])
