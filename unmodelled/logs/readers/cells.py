"""Cells of text tables that hold more than a number: lists, dates, words beside numbers."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pandas as pd
from pandas.tseries.api import guess_datetime_format

from unmodelled.base.limits import check_memory
from unmodelled.logs.readers.reader import Array
from unmodelled.logs.readers.records import ELEMENTS, listed

DAY = 86_400.0  # s
#: Share of the cells of a column that must hold values if it is one of numbers.
SHARE = 0.5


def is_list(cells: pd.Series) -> bool:
    """Return whether cells are lists such as "[0.1, 0.2]", by the first one that is filled."""
    first = next((cell for cell in cells if cell), "")
    return first.startswith("[") and first.endswith("]")


def lists(path: Path, name: str, cells: pd.Series) -> tuple[dict[str, Array], list[int]]:
    """Return the columns (rows,) of cells with lists of numbers, and the lengths of the lists."""
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


def words(cell: str) -> tuple[str, ...]:
    """Return the words in a cell with a list of them, such as "['hip', 'knee']" or "[hip knee]"."""
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


def times(cells: pd.Series) -> Array | None:
    """Return dates and times of day in s (rows,) since the first one; None for other texts."""
    filled = cells[cells != ""]
    if not len(filled) or not filled.str.contains(r"\d:\d\d").mean() > SHARE:
        return None
    plain = filled.str.replace(",", ".")
    dotted = plain.str.match(r"\d\d?\.\d\d?\.\d{4}")
    if dotted.all():
        plain = plain.str.replace(r"(\d\d?)\.(\d\d?)\.(\d{4})", r"\3-\2-\1", regex=True)
    if of_day := bool(plain.str.match(r"\d\d?:").all()):
        plain = "1970-01-01 " + plain
    since = _since_first(plain)
    if since is None:
        return None
    if of_day:  # midnight is where it falls by more than half a day
        since += DAY * (since.ffill().diff() < -0.5 * DAY).cumsum()
    return np.asarray(since.reindex(cells.index), np.float64)


def _since_first(cells: pd.Series) -> pd.Series | None:
    """Dates, or durations such as "0 days 00:00:01.5", in s since the first one; None if most are neither.

    Of a day and a month that can change places, those that make the record shorter are taken.
    """
    read = [pd.to_datetime(cells, format="ISO8601", utc=True, errors="coerce")]
    # the format of a time in the afternoon is not guessed
    guess = guess_datetime_format(re.sub(r"[Pp][Mm]$", "AM", str(cells.iloc[0])[:60]))
    if guess and read[0].notna().mean() <= SHARE:
        swapped = re.sub("%[md]", lambda found: "%d" if found[0] == "%m" else "%m", guess)
        read = [pd.to_datetime(cells, format=each, utc=True, errors="coerce") for each in (guess, swapped)]
    if cells.str.match(r"-?\d+ days?\b").all():
        read.append(pd.to_timedelta(cells, errors="coerce"))
    spans = [(each - each.min()).dt.total_seconds() for each in read if each.notna().mean() > SHARE]
    return min(spans, key=lambda each: float(each.max()), default=None)


def numbers(cells: pd.Series, decimal: str) -> Array | None:
    """Return numbers (rows,) among other texts; None if most are other texts."""
    plain = cells.str.replace(",", ".") if decimal == "," else cells
    truths = {"true": "1", "false": "0"}
    plain = plain.str.lower().replace(truths).str.replace(r"(?<=\d)d(?=[-+\d])", "e", regex=True)
    found = pd.to_numeric(plain, errors="coerce")
    filled = int((cells != "").sum())
    if not filled or found.notna().sum() <= SHARE * filled:
        return None
    return np.asarray(found, np.float64)
