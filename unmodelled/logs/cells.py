"""Cells of a table as finite numbers, with refusals that name row and column."""

from __future__ import annotations

from collections.abc import Mapping
from decimal import Decimal
from numbers import Real
from pathlib import Path

import numpy as np
import pandas as pd

from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput, Faults

#: No measurement is larger, and squares of what is smaller do not overflow.
LARGEST = 1e100


def frame_columns(path: Path, columns: Mapping[str, pd.Series]) -> dict[str, Array]:
    """Return the finite numbers (rows,) of columns of a frame; dates in `t` as s since the first one."""
    faults, values = Faults(), dict[str, Array]()
    for name, column in columns.items():
        with faults.collected():
            values[name] = _frame_numbers(path, name, column)
    faults.check()
    return values


def _frame_numbers(path: Path, name: str, column: pd.Series) -> Array:
    kind = column.dtype
    if name == "t" and (since := _since_first(column)) is not None:
        return since
    if kind is np.dtype(object):
        cells = [_number(cell) for cell in column]
        bad = [k for k, cell in enumerate(cells) if cell is None]
        if bad:
            raise no_number(path, bad[0] + 1, name, shown(str(column.iloc[bad[0]])), len(bad))
        values = np.array(cells, np.float64)
    elif pd.api.types.is_integer_dtype(kind) or pd.api.types.is_float_dtype(kind):
        values = column.to_numpy(np.float64, na_value=np.nan)
    else:
        cell = shown(str(column.iloc[0])) if len(column) else str(kind)
        raise no_number(path, 1, name, cell, len(column))
    check_finite(path, name, values)
    return values


def _since_first(column: pd.Series) -> Array | None:
    """Dates or durations in s since the first one; None for others, or if one is missing."""
    kind = pd.api.types.infer_dtype(column, skipna=True)
    if kind in ("datetime", "datetime64"):
        column = pd.to_datetime(column, utc=True)
    elif kind in ("timedelta", "timedelta64"):
        column = pd.to_timedelta(column)
    else:
        return None
    if column.isna().any():
        return None
    return np.asarray((column - column.iloc[0]).dt.total_seconds(), np.float64)


def _number(cell: object) -> float | None:
    """A cell as a number, nan for an empty one; None for what is no number."""
    if isinstance(cell, bool):  # Python counts it among the numbers
        return None
    if cell is None or cell is pd.NA:
        return np.nan
    return float(cell) if isinstance(cell, Real | Decimal) else None


def check_finite(path: Path, column: str, values: Array) -> None:
    """Refuse numbers (samples,) of a file without a header that are not finite, or beyond any measurement."""
    bad = np.flatnonzero(~(np.abs(values) < LARGEST))
    if len(bad):
        cell = "an empty cell" if np.isnan(values[bad[0]]) else str(values[bad[0]])
        raise no_number(path, int(bad[0]) + 1, column, cell, len(bad))


def shown(text: str) -> str:
    """Return a user's text, quoted and on one line."""
    return repr(text[:30])


def no_number(path: Path, row: int, column: str, cell: str, count: int, advice: str = "") -> BadInput:
    """Return the error that a cell is no finite number."""
    more = f" (the first of {count} such rows)" if count > 1 else ""
    place = f"{path}: row {row}: column {column}"
    return BadInput(f"{place}: {cell} is not a finite number below {LARGEST:g}{advice}{more}")
