"""Long tables, with a thing, its value and a time in every row: a table for every thing, by its name."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from unmodelled.base.arrays import Array, Indices
from unmodelled.logs.readers.names import MOST
from unmodelled.logs.readers.reader import Table
from unmodelled.logs.readers.text_cells import numbers_in, times_in, words_among
from unmodelled.logs.time_units import in_seconds, seconds_of, unit_of_time

#: Words in the name of a column that names things, of times, and of units.
_THINGS = (
    "entity sensor signal tag topic variable measurement metric field point item series quantity parameter "
    "key device channel name id label node kanal messstelle"
)
_TIMES, _UNIT = "time timestamp stamp date datetime ts zeit", "unit units einheit"
#: Share of the switches between things, in random order, from which on their rows lie among each other.
AMONG = 0.5


@dataclass(frozen=True)
class _Shape:
    """Columns of a long table, and the number of the thing in every row."""

    names: Sequence[str]  # of the things
    code: Indices  # (rows,); -1: none
    value: str
    clock: Array  # (rows,), s


def by_thing(table: Table) -> list[Table]:
    """Return a table for every thing of a long table; any other table as it is."""
    dated = _with_dates(table) if table.texts else table
    shape = _shape(dated) if len(dated) else None
    if shape is None:
        return [dated]
    unit = next((name for name in dated.texts if _called(name, _UNIT)), None)
    return [
        _of_thing(dated, shape, name, np.flatnonzero(shape.code == k), unit)
        for k, name in enumerate(shape.names)
    ]


def _with_dates(table: Table) -> Table:
    """The table with texts of dates in s, and with the words of columns that hold numbers and words."""
    columns, texts = {**table.columns}, {**table.texts}
    units, origins = {**table.units}, {**table.origins}
    words = {**table.words}
    for name, cells in table.texts.items():
        if name in columns:
            words[name] = {k: cell for k, cell in enumerate(cells) if cell}
        elif (found := times_in(pd.Series(cells, dtype=object).astype(str))) is not None:
            columns[name], origins[name] = found
            units[name] = "s"
            del texts[name]
    return replace(table, columns=columns, texts=texts, units=units, origins=origins, words=words)


def _shape(table: Table) -> _Shape | None:
    """The columns of a long table; None for any other table."""
    for column in _namers(table):
        code, names = pd.factorize(np.array([cell or None for cell in table.texts[column]], object))
        varying = [name for name in table.columns if _varies(table.columns[name], code)]
        times = [name for name in varying if _is_time(table, name)]
        values = [name for name in varying if name not in times and not _counts(table.columns[name])]
        values = values or [name for name in table.texts if name != column and _holds_numbers(table, name)]
        if len(values) != 1 or not (times or table.clock is not None):
            continue
        clock = _seconds(table, times[0]) if times else table.clock
        if clock is not None and _lie_among(code, clock, _called(column, _THINGS)):
            return _Shape([str(name) for name in names], code, values[0], clock)
    return None


def clock_of(table: Table) -> Array | None:
    """Return times (rows,), s, by a column of dates or one that is called a time; None: there is none."""
    name = next((name for name in table.columns if _is_time(table, name)), None)
    return None if name is None else _seconds(table, name)


def _is_time(table: Table, name: str) -> bool:
    return name in table.origins or name == "t" or _called(name, _TIMES)


def _namers(table: Table) -> list[str]:
    """Columns that may name things: those that are called so first, of them the one with most names."""
    counts = {name: len(set(cells) - {""}) for name, cells in table.texts.items()}
    found = [name for name, count in counts.items() if 2 <= count <= min(MOST, len(table) // 2)]
    return sorted(found, key=lambda name: (not _called(name, _THINGS), -counts[name]))


def _called(name: str, words: str) -> bool:
    apart = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name)
    return bool({*words.split()} & {word.lower() for word in re.findall(r"[^\W\d_]+", apart)})


def _varies(values: Array, code: Indices) -> bool:
    """Whether numbers (rows,) change within a thing."""
    groups = pd.Series(values).groupby(code)
    return bool((groups.max() > groups.min()).any())


def _counts(values: Array) -> bool:
    """Whether numbers (rows,) count the rows."""
    return bool(np.all(np.diff(values) == 1.0))


def _holds_numbers(table: Table, name: str) -> bool:
    """Whether a column of text holds different numbers among its words."""
    return bool(pd.to_numeric(pd.Series(table.texts[name], dtype=object), errors="coerce").nunique() > 1)


def _seconds(table: Table, name: str) -> Array:
    values = table.columns[name]
    unit = table.units.get(name) or unit_of_time(name, values) or "s"
    return in_seconds(values, seconds_of(unit) or 1.0)


def _lie_among(code: Indices, clock: Array, called: bool) -> bool:
    """Whether the rows of things lie among each other in time, and in the file unless the column says it.

    Rows of an operating mode follow each other, and runs that all start at 0 s lie one after the other.
    """
    known = np.flatnonzero((code >= 0) & np.isfinite(clock))
    if len(known) < 2:
        return False
    shares = np.unique(code[known], return_counts=True)[1] / len(known)
    chance = 1.0 - float(np.sum(shares**2))
    in_time = code[known][np.argsort(clock[known], kind="stable")]
    orders = [in_time] if called else [in_time, code[known]]
    return all(float(np.mean(np.diff(order) != 0)) > AMONG * chance for order in orders)


def _of_thing(table: Table, shape: _Shape, name: str, rows: Indices, unit: str | None) -> Table:
    """The rows of a thing, with its value as numbers where most are."""
    own = table.among(f"{table.name}.{name}" if table.name else name, rows)
    columns, texts, words = {**own.columns}, {**own.texts}, {**own.words}
    if shape.value in texts:
        cells = pd.Series(texts[shape.value], dtype=object).astype(str).str.strip()
        if (values := numbers_in(cells, ".")) is not None:
            found = columns.get(shape.value, values)
            columns[shape.value] = np.where(np.isnan(found), values, found)
            words[shape.value] = words_among(cells, columns[shape.value])
            del texts[shape.value]
    given = next((cell for cell in texts.get(unit, ()) if cell), "") if unit else ""
    return replace(
        own,
        columns=columns,
        units={**own.units, **({shape.value: given} if given else {})},
        texts=texts,
        aliases={} if name in {*columns, *texts} else {name: shape.value},
        clock=shape.clock[rows],
        words={key: each for key, each in words.items() if each},
    )
