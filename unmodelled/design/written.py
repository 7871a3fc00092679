"""Experiments as files: written in the units of their columns, read back and compared with the limits."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from unmodelled.base.errors import BadInput
from unmodelled.base.files import replacing
from unmodelled.design.limits import Limits, Range
from unmodelled.design.runs import frame
from unmodelled.logs.assembly import in_si
from unmodelled.logs.table import Columns, read_columns
from unmodelled.systems.model import Input, System

Array = NDArray[np.float64]

#: Digits of a number in the file, and the share of a column's largest value that they may round away.
DIGITS, ROUNDING = "%.9g", 1e-8


def write_experiment(u: Array, system: System, limits: Limits, file: Path) -> None:
    """Write an experiment (samples, inputs), SI; it is kept only if it is read back within the limits."""
    with replacing(file) as temporary:
        frame(u, system, limits).to_csv(temporary, index=False, float_format=DIGITS)
        _, found = read_experiment(temporary, system, limits, file.name)
        largest = np.abs(u).max(axis=0) + [item.as_written.offset for item in system.inputs]
        if found.shape != u.shape or (np.abs(found - u) > ROUNDING * largest).any():
            raise BadInput(f"{file.name}: not written: it holds other inputs than designed: report this line")


def read_experiment(path: Path, system: System, limits: Limits, name: str) -> tuple[Array, Array]:
    """Return times (samples,), s, and inputs (samples, inputs), SI, of an experiment within the limits."""
    columns = read_columns(path, ["t", *(item.column for item in system.inputs)])
    t = columns.values["t"]
    if len(t) < 2 or not (np.diff(t) > 0.0).all():
        raise BadInput(f"{name}: column t: does not increase: write the time of every sample in s")
    for item, own in zip(system.inputs, limits.written, strict=True):
        for row, what in _beyond(columns, item, own):
            raise BadInput(
                f"{name}: row {columns.row(row)}: column {item.column}: {what} in {limits.file}: change one"
            )
    found = in_si(columns, system).values
    return t - t[0], np.stack([found[item.column] for item in system.inputs], axis=1)


def _beyond(columns: Columns, item: Input, own: Range) -> Iterator[tuple[int, str]]:
    """Number and description of the first sample that leaves the range, and of the first that is too fast."""
    t, x, unit = columns.values["t"], columns.values[item.column], item.column_unit
    slack = ROUNDING * max(float(np.abs(x).max()), abs(own.low), abs(own.high))
    outside = np.flatnonzero((x < own.low - slack) | (x > own.high + slack))
    if len(outside):
        at = int(outside[0])
        yield at, f"{x[at]:.6g} {unit} is beyond the limits {own.low:g} to {own.high:g} {unit}"
    if np.isfinite(own.rate):
        most = own.rate * (np.diff(t) + ROUNDING * np.ptp(t)) + 2.0 * slack
        fast = np.flatnonzero(np.abs(np.diff(x)) > most)
        if len(fast):
            at = int(fast[0])
            rate = abs(x[at + 1] - x[at]) / (t[at + 1] - t[at])
            yield at + 1, f"{rate:.6g} {unit}/s is faster than the limit {own.rate:g} {unit}/s"
