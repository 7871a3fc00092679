"""Read text tables of any dialect: CSV, tab-separated, with decimal commas, comments, units, or no header."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from unmodelled.base.errors import BadInput
from unmodelled.base.limits import OBJECTS, check_file
from unmodelled.logs.readers.dialect import UNIT, Dialect, dialect_of
from unmodelled.logs.readers.reader import Array, Reader, Table
from unmodelled.logs.readers.records import listed

#: Share of the cells of a column that must hold values if it is one of numbers.
SHARE = 0.5


class Delimited(Reader):
    """Reader of text tables."""

    name = "CSV"
    install = ""
    isolated = False

    def recognises(self, path: Path, start: bytes) -> bool:
        return bool(start) and (b"\x00" not in start or start[:2] in (b"\xff\xfe", b"\xfe\xff"))

    def read(self, path: Path, wanted: Sequence[str] | None) -> list[Table]:
        check_file(path, OBJECTS / 4)
        dialect = dialect_of(path)
        frame = _frame(path, dialect)
        columns: dict[str, Array] = {}
        texts: dict[str, Sequence[str]] = {}
        units = dict(dialect.units)
        for name in dialect.names:
            cells = frame[name]
            if cells.dtype.kind in "fiub":
                columns[name] = cells.to_numpy(np.float64)
                continue
            text = cells.fillna("").astype(str).str.strip()
            if (lists := _lists(name, text)) is not None:
                columns |= lists
            elif (time := _times(text)) is not None:
                columns[name] = time
                units[name] = "s"
            elif (numbers := _numbers(text, dialect.decimal)) is not None:
                columns[name] = numbers
            else:
                texts[name] = text.tolist()
        aliases = {match["name"]: name for name in dialect.names if (match := UNIT.fullmatch(name))}
        return [Table("", columns, units, texts, aliases, first=dialect.skipped + 1)]


def _frame(path: Path, dialect: Dialect) -> pd.DataFrame:
    try:
        return pd.read_csv(
            path,
            sep=r"\s+" if dialect.separator == " " else dialect.separator,
            decimal=dialect.decimal,
            encoding=dialect.encoding,
            skiprows=dialect.skipped,
            header=None,
            names=list(dialect.names),
            index_col=False,
            skipinitialspace=True,
            low_memory=False,
        )
    except pd.errors.ParserError as error:
        found = re.search(r"Expected (\d+) fields in line (\d+), saw (\d+)", str(error))
        if found is None:
            raise
        wanted, row, got = found.groups()
        raise BadInput(f"{path}: row {row}: must have {wanted} columns, got {got}: correct the row") from None


def _lists(name: str, cells: pd.Series) -> dict[str, Array] | None:
    """Columns from cells such as "[0.1, 0.2]"; None if they are none."""
    first = next((cell for cell in cells if cell), "")
    if not (first.startswith("[") and first.endswith("]")):
        return None
    rows = _plain_lists(cells) or [_list(cell) for cell in cells]
    width = max(map(len, rows))
    return listed(name, np.array([row + [np.nan] * (width - len(row)) for row in rows]))


def _plain_lists(cells: pd.Series) -> list[list[float]]:
    """Lists that are written as in JSON, read all at once; none if there is another one."""
    try:
        rows = json.loads(f"[{','.join(cells)}]")
    except (ValueError, RecursionError):
        return []
    plain = all(isinstance(row, list) and all(type(x) in (int, float) for x in row) for row in rows)
    return rows if plain and len(rows) == len(cells) else []


def _list(cell: str) -> list[float]:
    inner = re.sub(r"[;\s]+", " ", cell.strip("[]").replace(",", " ")).split()
    try:
        return [float(number) for number in inner]
    except ValueError:
        return []


def _times(cells: pd.Series) -> Array | None:
    """Dates and times of day in s since the first one; None if the cells are neither."""
    filled = cells[cells != ""]
    if not len(filled) or not filled.str.contains(r"\d:\d\d").mean() > SHARE:
        return None
    plain = filled.str.replace(",", ".")
    dotted = plain.str.match(r"\d\d?\.\d\d?\.\d{4}")
    if dotted.all():
        plain = plain.str.replace(r"(\d\d?)\.(\d\d?)\.(\d{4})", r"\3-\2-\1", regex=True)
    if plain.str.match(r"\d\d?:").all():
        plain = "1970-01-01 " + plain
    found = pd.to_datetime(plain, format="ISO8601", utc=True, errors="coerce")
    if found.notna().mean() <= SHARE:
        return None
    since = (found - found.min()).reindex(cells.index)
    return np.asarray(since.dt.total_seconds(), np.float64)


def _numbers(cells: pd.Series, decimal: str) -> Array | None:
    """Numbers among other texts, which become nan; None if most cells are no numbers."""
    plain = cells.str.replace(",", ".") if decimal == "," else cells
    truths = {"true": "1", "false": "0"}
    plain = plain.str.lower().replace(truths).str.replace(r"(?<=\d)d(?=[-+\d])", "e", regex=True)
    found = pd.to_numeric(plain, errors="coerce")
    filled = int((cells != "").sum())
    if not filled or found.notna().sum() <= SHARE * filled:
        return None
    return np.asarray(found, np.float64)
