"""Read text tables of any dialect: CSV, tab-separated, with decimal commas, comments, units, or no header."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from unmodelled.base.errors import BadInput
from unmodelled.base.limits import OBJECTS, check_file
from unmodelled.logs.readers.cells import is_list, lists, numbers, times, words
from unmodelled.logs.readers.dialect import UNIT, Dialect, dialect_of
from unmodelled.logs.readers.names import Beside, by_cells
from unmodelled.logs.readers.reader import Array, Reader, Table


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
        beside = Beside()
        units = dict(dialect.units)
        for name in dialect.names:
            cells = frame[name]
            if cells.dtype.kind in "fiub":
                columns[name] = cells.to_numpy(np.float64, copy=True)
                continue
            text = cells.fillna("").astype(str).str.strip()
            if is_list(text):
                found, lengths = lists(path, name, text)
                columns |= found
                if found:
                    beside.lengths[name] = lengths
                elif not any(lengths):
                    beside.names[name] = [words(cell) for cell in text]
            elif (time := times(text)) is not None:
                columns[name] = time
                units[name] = "s"
            elif (values := numbers(text, dialect.decimal)) is not None:
                columns[name] = values
            else:
                texts[name] = text.tolist()
        kept = [name for name in dialect.names if name in columns or name in texts]
        aliases = {match["name"].strip(): name for name in kept if (match := UNIT.fullmatch(name))}
        table = Table("", columns, units, texts, aliases, first=dialect.skipped + 1)
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
        raise BadInput(f"{path}: row {row}: must have {wanted} columns, got {got}: correct the row") from None
