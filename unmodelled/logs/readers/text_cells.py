"""Dates and numbers in cells of text."""

from __future__ import annotations

import re

import numpy as np
import pandas as pd
from pandas.tseries.api import guess_datetime_format

from unmodelled.base.arrays import Array
from unmodelled.logs.readers.dialect import NAMED
from unmodelled.logs.time_units import DAY

#: Share of the cells of a column that must hold values if it is one of numbers.
SHARE = 0.5


def times_in(cells: pd.Series) -> tuple[Array, int] | None:
    """Return dates and times of day in s (rows,) since the first one, and that one in ns; None for others."""
    filled = cells[cells != ""]
    if not len(filled) or not filled.str.contains(r"\d:\d\d").mean() > SHARE:
        return None
    plain = filled.str.replace(",", ".")
    dotted = plain.str.match(r"\d\d?\.\d\d?\.\d{4}")
    if dotted.all():
        plain = plain.str.replace(r"(\d\d?)\.(\d\d?)\.(\d{4})", r"\3-\2-\1", regex=True)
    if of_day := bool(plain.str.match(r"\d\d?:").all()):
        plain = "1970-01-01 " + plain
    found = _since_first(plain)
    if found is None:
        return None
    since, first = found
    if of_day:  # midnight is where it falls by more than half a day
        since += DAY * (since.ffill().diff() < -0.5 * DAY).cumsum()
    return np.asarray(since.reindex(cells.index), np.float64), first


def _since_first(cells: pd.Series) -> tuple[pd.Series, int] | None:
    """Dates, or durations such as "0 days 00:00:01.5", in s since the first one, and that one in ns.

    None if most are neither.

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
    firsts = [(each, each.min()) for each in read if each.notna().mean() > SHARE]
    spans = [((each - first).dt.total_seconds(), first.as_unit("ns").value) for each, first in firsts]
    return min(spans, key=lambda each: float(each[0].max()), default=None)


def numbers_in(cells: pd.Series, decimal: str) -> Array | None:
    """Return the numbers (rows,) among texts, with `decimal` as mark; None if most are other texts."""
    plain = cells.str.replace(",", ".") if decimal == "," else cells
    truths = {"true": "1", "false": "0", "on": "1", "off": "0"}
    plain = plain.str.lower().replace(truths).str.replace(r"(?<=\d)d(?=[-+\d])", "e", regex=True)
    found = pd.to_numeric(plain, errors="coerce")
    filled = int((cells != "").sum())
    if not filled or found.notna().sum() <= SHARE * filled:
        return None
    return np.asarray(found, np.float64)


def without_name(cells: pd.Series) -> tuple[str | None, pd.Series]:
    """Return the name before all numbers (rows,), as in `yaw=1.5`, and the cells without it; None: none."""
    found = NAMED.fullmatch(str(cells.iloc[0])) if len(cells) else None
    if found is None:
        return None, cells
    first = found[0][: len(found[1]) + 1]
    named = cells.str.startswith(first) | (cells == "")
    return (found[1], cells.str.removeprefix(first)) if named.all() else (None, cells)


def words_among(cells: pd.Series, values: Array) -> dict[int, str]:
    """Return words among numbers (rows,), such as "unavailable", by row; an empty cell is none."""
    word = (cells != "") & (cells.str.lower() != "nan")
    bad = np.flatnonzero(np.isnan(values) & word.to_numpy())
    return {int(row): str(cells.iloc[row]) for row in bad}
