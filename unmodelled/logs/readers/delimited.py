"""Read text tables of any dialect: CSV, tab-separated, with decimal commas, comments, units, or no header."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.base.limits import OBJECTS, check_file, check_memory
from unmodelled.logs.readers.dialect import UNIT, Dialect, dialect_of
from unmodelled.logs.readers.names import Beside, by_cells
from unmodelled.logs.readers.reader import Reader, Table
from unmodelled.logs.readers.records import ELEMENTS, listed
from unmodelled.logs.readers.text_cells import numbers_in, times_in, without_name, words_among
from unmodelled.logs.recognition import BLACKBOX


class Delimited(Reader):
    """Reader of text tables."""

    name = "CSV"
    install = ""
    isolated = False

    def recognises(self, path: Path, start: bytes) -> bool:
        text = b"\x00" not in start or start[:2] in (b"\xff\xfe", b"\xfe\xff")
        return bool(start) and text and not start.startswith(BLACKBOX)

    def read(self, path: Path, wanted: Sequence[str] | None) -> list[Table]:
        check_file(path, OBJECTS / 4)
        dialect = dialect_of(path)
        frame = _frame(path, dialect)
        aliases = {match["name"].strip(): name for name in dialect.names if (match := UNIT.fullmatch(name))}
        empty = Table("", {}, dialect.units, aliases=aliases, first=dialect.skipped + 1)
        return filled(path, empty, frame, dialect.decimal)


def filled(path: Path, empty: Table, frame: pd.DataFrame, decimal: str) -> list[Table]:
    """Return the tables, see `by_cells`, of a frame (rows, columns) of numbers and texts.

    The name, the units and the rows are those of `empty`.
    """
    columns: dict[str, Array] = {}
    texts: dict[str, Sequence[str]] = {}
    words: dict[str, dict[int, str]] = {}
    beside = Beside()
    units, origins = dict(empty.units), dict[str, int]()
    for column in map(str, frame):
        cells, name = frame[column], column
        if cells.dtype.kind in "fiub":
            columns[name] = cells.to_numpy(np.float64, copy=True)
            continue
        text = cells.fillna("").astype(str).str.strip()
        own, text = without_name(text)
        name = name if own is None or own in {*columns, *texts} else own
        if _is_list(text):
            found, lengths = _lists(path, name, text)
            columns |= found
            if found:
                beside.lengths[name] = lengths
            elif not any(lengths):
                beside.names[name] = [_words(cell) for cell in text]
        elif (time := times_in(text)) is not None:
            columns[name], origins[name] = time
            units[name] = "s"
        elif (values := numbers_in(text, decimal)) is not None:
            columns[name] = values
            words[name] = words_among(text, values)
        else:
            texts[name] = text.tolist()
    aliases = {alias: name for alias, name in empty.aliases.items() if name in {*columns, *texts}}
    table = replace(
        empty, columns=columns, units=units, texts=texts, aliases=aliases, origins=origins, words=words
    )
    return by_cells(table, beside)


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
            compression=None,  # what an ending says of a text is not so
        )
    except pd.errors.ParserError as error:
        found = re.search(r"Expected (\d+) fields in line (\d+), saw (\d+)", str(error))
        if found is None:
            raise
        wanted, row, got = found.groups()
        advice = "correct the row, or write lines of other kinds into files of their own"
        raise BadInput(f"{path}: row {row}: must have {wanted} columns, got {got}: {advice}") from None


def _is_list(cells: pd.Series) -> bool:
    """Whether cells are lists such as "[0.1, 0.2]", by the first one that is filled."""
    first = next((cell for cell in cells if cell), "")
    return first.startswith("[") and first.endswith("]")


def _lists(path: Path, name: str, cells: pd.Series) -> tuple[dict[str, Array], list[int]]:
    """Columns (rows,) of cells with lists of numbers, and the lengths of the lists."""
    rows = _plain_lists(cells) or [_list(cell) for cell in cells]
    lengths = [len(row) for row in rows]
    width = max(lengths)
    if not 0 < width <= ELEMENTS:
        return {}, lengths
    check_memory(f"{path}: column {name}", 16.0 * width * len(rows))
    values = np.full((len(rows), width), np.nan)
    for k, row in enumerate(rows):
        values[k, : len(row)] = row
    return listed(name, values), lengths


def _words(cell: str) -> tuple[str, ...]:
    """The words in a cell with a list of them, such as "['hip', 'knee']" or "[hip knee]"."""
    inner = cell.strip("[]() ")
    parts = re.split(r"[,;]", inner) if re.search(r"[,;]", inner) else inner.split()
    return tuple(part.strip(" \t'\"") for part in parts[: ELEMENTS + 1])


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
