"""Experiments: simulated from the start that the limits give, and as files in the units of their columns."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import sympy as sp

from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.base.files import replacing
from unmodelled.design.limits import Limits, Range
from unmodelled.engine.free_run import Integration, Windows, free_run
from unmodelled.engine.machine.program import Program
from unmodelled.logs.assembly import in_si
from unmodelled.logs.logs import as_logged
from unmodelled.logs.table import Columns, read_columns
from unmodelled.systems.model import Input, System, symbol


def frame(u: Array, system: System, limits: Limits) -> pd.DataFrame:
    """Return an experiment (samples, inputs), SI, as a user runs it: t (s), inputs in logged units."""
    columns = {item.column: as_logged(item, u[:, k]) for k, item in enumerate(system.inputs)}
    return pd.DataFrame({"t": limits.period * np.arange(len(u)), **columns})


def quantities(system: System, names: Iterable[str]) -> tuple[sp.Expr, ...]:
    """Return states, outputs and signals as expressions."""
    outputs = {o.name: o.expression for o in system.outputs}
    states = {s.name for s in system.states}
    return tuple(outputs[n] if n in outputs and n not in states else system.expression(n) for n in names)


def equations(system: System, watched: Sequence[sp.Expr]) -> Program:
    """Compile a system with its outputs, and with quantities to watch."""
    return Program.of(system, [*(o.expression for o in system.outputs), *watched])


def simulated(
    systems: Sequence[System], u: Array, limits: Limits, c: Array, substeps: int, program: Program
) -> tuple[Array, Array]:
    """Simulate experiments u (designs, samples, inputs) at constants c with several sets of numbers, SI.

    Gives outputs (designs, sets, samples, outputs) and quantities (designs, sets, samples, quantities).
    """
    designs, samples, _ = u.shape
    # by (set, design, sample): every set of numbers has input delays of its own
    late = [[item.delay / limits.period for item in s.inputs] for s in systems]
    tables = np.concatenate([_later(u, delays).reshape(-1, u.shape[2]) for delays in late])
    first = samples * np.arange(designs)
    windows = Windows(
        *(tables, np.tile(limits.period * np.arange(samples), designs), first),
        *(np.full(designs, samples - 1), np.zeros(designs, np.int64)),
        samples * designs * np.arange(len(systems)),
    )
    p = np.array([s.values for s in systems])[None]
    x0 = np.array([start_of(s, limits, c, u[0, 0]) for s in systems])
    hold = tuple(item.course for item in systems[0].inputs)
    how = Integration(limits.period, "rk4", max(substeps, 1), hold)
    start = np.tile(x0, (designs, 1, 1))
    with np.errstate(all="ignore"):
        found = free_run(program, windows, p, c[None], start, how)
    outputs = len(systems[0].outputs)
    y = found[..., :outputs]
    shown = [[item.delay / limits.period for item in s.outputs] for s in systems]
    y = np.stack([_later(y[:, k], delays) for k, delays in enumerate(shown)], axis=1)
    return y, found[..., outputs:]


def start_of(system: System, limits: Limits, c: Array, u: Array) -> list[float]:
    """Return start states, SI; those not given follow from the file at c (constants,) and u (inputs,)."""
    known: dict[sp.Expr, float] = dict(zip(system.p, system.values, strict=True))
    known |= dict(zip(system.c, c.tolist(), strict=True)) | dict(zip(system.u, u.tolist(), strict=True))
    start = limits.start
    known |= {symbol(s.name): start.get(s.name, 0.0) for s in system.states}
    return [start[s.name] if s.name in start else float(s.initial.xreplace(known)) for s in system.states]


def _later(values: Array, delays: Sequence[float]) -> Array:
    """Signals (designs, samples, channels), each by its delay (samples) later; they rest before the start."""
    if not any(delays):
        return values
    last = values.shape[1] - 1
    shifted = []
    for k, delay in enumerate(delays):
        at = np.clip(np.arange(last + 1) - delay, 0.0, last)
        left = np.minimum(at.astype(np.int64), last - 1)
        own = values[:, :, k]
        shifted.append(own[:, left] + (at - left) * (own[:, left + 1] - own[:, left]))
    return np.stack(shifted, axis=-1)


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
