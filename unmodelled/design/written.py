"""Experiments as files, in the units of their columns; a file is kept only if it keeps all limits."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.base.files import replacing
from unmodelled.design.limits import Limits, Range, units_of
from unmodelled.design.runs import Simulated
from unmodelled.logs.assembly import in_si
from unmodelled.logs.logs import as_logged
from unmodelled.logs.recognition import Source
from unmodelled.logs.table import Columns, RawTable
from unmodelled.logs.time_units import CLOCKS, clock_column, in_clock, seconds_of
from unmodelled.systems.model import Input, System

#: Digits of a number in the file, and the share of a column's largest value that they may round away.
DIGITS, ROUNDING = "%.9g", 1e-8

#: Simulates an experiment (samples, inputs), SI, with one model after the other.
Watch = Callable[[Array], Iterable[Simulated]]


def frame(u: Array, system: System, limits: Limits) -> pd.DataFrame:
    """Return an experiment (samples, inputs), SI, as a user runs it: clock and inputs in logged units."""
    columns = {item.column: as_logged(item, u[:, k]) for k, item in enumerate(system.inputs)}
    return in_clock(pd.DataFrame({"t": limits.period * np.arange(len(u)), **columns}), limits.clock)


def write_experiment(
    u: Array, system: System, limits: Limits, file: Path, watch: Watch, at_rest: bool = True
) -> None:
    """Write an experiment (samples, inputs), SI; it is kept only if what is read back keeps the limits.

    Clock and inputs must be the designed ones, inputs and their rates within the limits, at rest at the ends
    if the program chose them, and the models must stay within the travel.
    """
    with replacing(file) as temporary:
        frame(u, system, limits).to_csv(temporary, index=False, float_format=DIGITS)
        columns, found = _read(temporary, system, limits, file.name)
        clock = limits.period * np.arange(len(u))
        largest = np.abs(u).max(axis=0) + [item.as_written.offset for item in system.inputs]
        if found.shape != u.shape or (np.abs(found - u) > ROUNDING * largest).any():
            raise BadInput(f"{file.name}: not written: it holds other inputs than designed: report this line")
        if (np.abs(columns.values["t"] - clock) > ROUNDING * clock[-1]).any():
            raise BadInput(f"{file.name}: not written: it holds other times than designed: report this line")
        for end, name in ((0, "begins"), (-1, "ends")) if at_rest else ():
            for item, own in zip(system.inputs, limits.written, strict=True):
                x = columns.values[item.column]
                if abs(x[end] - own.level) > _slack(x, own):
                    raise BadInput(
                        f"{file.name}: not written: column {item.column} {name} at {x[end]:.6g} "
                        f"{item.column_unit}, not at rest: report this line"
                    )
        check_travel(watch(found), system, limits, f"{file.name}: not written")


def check_travel(runs: Iterable[Simulated], system: System, limits: Limits, name: str) -> None:
    """Refuse runs of one experiment that leave the travel as it is written."""
    units = units_of(system)
    for _, watched, step in runs:
        if not np.isfinite(watched).all():
            raise BadInput(f"{name}: the simulation diverges: change the inputs")
        for key, column in limits.columns(watched):
            own, x, text = limits.moves[key], units[key].from_si(column), f" {units[key].text}"
            speed = np.abs(np.diff(x, axis=-1)).max() / step
            slack = ROUNDING * max(float(np.abs(x).max()), np.ptp(x))
            for value in (float(x.min()), float(x.max())):
                if not own.low - slack <= value <= own.high + slack:
                    raise BadInput(
                        f"{name}: {key} reaches {value:.4g}{text}, beyond its travel {own.low:g} to "
                        f"{own.high:g}{text} in {limits.file}: change one"
                    )
            if speed > own.rate * (1.0 + ROUNDING):
                raise BadInput(
                    f"{name}: {key} moves at {speed:.4g}{text}/s, faster than its speed {own.rate:g}{text}/s "
                    f"in {limits.file}: change one"
                )


def read_experiment(path: Path, system: System, limits: Limits, name: str) -> tuple[Array, Array]:
    """Return times (samples,), s, and inputs (samples, inputs), SI, of an experiment within the limits."""
    columns, u = _read(path, system, limits, name)
    t = columns.values["t"]
    return t - t[0], u


def _read(path: Path, system: System, limits: Limits, name: str) -> tuple[Columns, Array]:
    """Columns in the units of the file, and inputs (samples, inputs), SI, within their limits."""
    columns = _columns(path, system)
    t = columns.values["t"]
    if len(t) < 2 or not (np.diff(t) > 0.0).all():
        raise BadInput(f"{name}: column t: does not increase: write the time of every sample in s")
    for item, own in zip(system.inputs, limits.written, strict=True):
        for row, what in _beyond(columns, item, own):
            raise BadInput(
                f"{name}: row {columns.row(row)}: column {item.column}: {what} in {limits.file}: change one"
            )
    found = in_si(columns, system).values
    return columns, np.stack([found[item.column] for item in system.inputs], axis=1)


def _columns(path: Path, system: System) -> Columns:
    """Columns in the units of the file, but column `t` in s, also where the file names it by its unit."""
    inputs = [item.column for item in system.inputs]
    table = RawTable(Source.of(path))
    unit = next((unit for unit in CLOCKS if clock_column(unit) in {*table.header} - {*inputs}), "s")
    columns = table.columns([name := clock_column(unit), *inputs])
    t = (seconds_of(unit) or 1.0) * columns.values[name]
    return replace(columns, values={**columns.values, "t": t})


def rest_notes(system: System, limits: Limits) -> list[str]:
    """Return a note for every input whose limits exclude zero, so that no experiment begins at rest."""
    found = []
    for item, own in zip(system.inputs, limits.written, strict=True):
        if own.level:
            unit = item.column_unit
            rate = f", at most {own.rate:g} {unit}/s" if np.isfinite(own.rate) else ""
            found.append(
                f"{item.name} begins and ends at {own.level:g} {unit}, because its limits exclude zero: "
                f"bring it there before the first sample and back after the last one{rate}, with the machine "
                "at its start"
            )
    return found


def ends_notes(tables: Iterable[tuple[str, pd.DataFrame]], system: System, limits: Limits) -> list[str]:
    """Return a note for every input that does not begin and end at rest in an experiment, by its name."""
    found = []
    for name, table in tables:
        for item, own in zip(system.inputs, limits.written, strict=True):
            x, unit = table[item.column].to_numpy(), item.column_unit
            if np.abs(x[[0, -1]] - own.level).max() > _slack(x, own):
                found.append(
                    f"{name}: {item.name} begins at {x[0]:.4g} {unit} and ends at {x[-1]:.4g} {unit}, not at "
                    f"{own.level:g} {unit}: add the way from rest and back to it before it runs"
                )
    return found


def _slack(x: Array, own: Range) -> float:
    ends = [abs(end) for end in (own.low, own.high) if np.isfinite(end)]
    return ROUNDING * max(float(np.abs(x).max()), *ends)


def _beyond(columns: Columns, item: Input, own: Range) -> Iterator[tuple[int, str]]:
    """Number and description of the first sample that leaves the range, and of the first that is too fast."""
    t, x, unit = columns.values["t"], columns.values[item.column], item.column_unit
    slack = _slack(x, own)
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
