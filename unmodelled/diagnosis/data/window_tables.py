"""Inputs and initial states of windows, as sensor gains and delays change them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import sympy as sp

from unmodelled.base.arrays import Array, Indices
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.data.sensors import Sensors
from unmodelled.engine.machine.program import Program
from unmodelled.logs.clock import EVERY, Rows, delayed
from unmodelled.logs.logs import Logs
from unmodelled.logs.readings import Reading, readings
from unmodelled.systems.model import TIME, System


@dataclass(frozen=True)
class WindowTables:
    """The samples of all experiments, once for all parameter sets that read them alike."""

    u: Array  # inputs at the time when they act, (input tables, samples, inputs)
    x: Array  # measured states as they were asked for, (tables, read samples, read states)
    acting: Indices  # input table of every table of states, (tables,)
    member: Indices  # table of states of every parameter set, (sets,)

    @property
    def shift(self) -> Indices:
        """Return the number, shape (sets,), of rows before the input table of every set."""
        return np.asarray(self.acting[self.member] * self.u.shape[1])


class WindowTableReader:
    """Make the tables of parameter sets at operating points `c` (experiments, constants).

    `input_delays` and `output_delays`: column of a delay (s) in a set, by number of the input or output.
    """

    def __init__(
        self, system: System, input_delays: Mapping[int, int], output_delays: Mapping[int, int], c: Array
    ) -> None:
        self.system, self.c = system, c
        self.input_delays, self.output_delays = input_delays, output_delays
        self.readings = readings(system)
        symbols = {s for r in self.readings for e in (r.gain, r.offset, r.lag) for s in e.free_symbols}
        known = [k for k, s in enumerate(system.p) if s in symbols]
        self.columns = [*known, *input_delays.values(), *output_delays.values()]

    def __call__(
        self, values: Array, recording: Recording, rows: Rows = EVERY, states: Sequence[int] | None = None
    ) -> WindowTables:
        """Return the tables of parameter sets (experiments, sets, numbers), SI, at some or all samples."""
        read = range(len(self.readings)) if states is None else states
        first, member = _alike(values[:, :, self.columns])
        some, owner = values[:, first], recording.logs.owner[rows]
        one, acting = _alike(some[:1, :, list(self.input_delays.values())])
        u = recording.logs.u[None]
        if self.input_delays:
            u = np.stack([self._inputs(each, recording.logs) for each in some[0, one]])
        x = np.empty((len(first), len(owner), len(read)))
        plain = all(self.readings[j].plain for j in read)
        for k, delays in enumerate(self.delays(some[0])):
            gains = None if plain else self.gains(some[:, k], u[acting[k], rows], owner)[:, read]
            for n, reading in enumerate(self.readings[j] for j in read):
                lag = np.zeros(1) if gains is None or reading.lag == 0 else gains[:, n, 2]
                x[k, :, n] = _read(recording.sensors, reading, float(delays[reading.output]), lag, rows)
            if gains is not None:
                x[k] = (x[k] - gains[:, :, 1]) / gains[:, :, 0]
        return WindowTables(u, x, acting, member)

    def delays(self, values: Array) -> Array:
        """Return the delays (sets, outputs), s, of the outputs under parameter sets (sets, numbers)."""
        found = np.tile([output.delay for output in self.system.outputs], (len(values), 1))
        for j, column in self.output_delays.items():
            found[:, j] += values[:, column]
        return found

    def _inputs(self, values: Array, logs: Logs) -> Array:
        inputs = range(logs.u.shape[1])
        delays = [float(values[self.input_delays[j]]) if j in self.input_delays else 0.0 for j in inputs]
        return delayed(logs.u, logs.offsets, logs.period, delays, "linear")

    def gains(self, values: Array, u: Array, owner: Indices) -> Array:
        """Return gain, offset and lag (s) of the measured states, (samples, readings, 3)."""
        if self.plain:
            return np.broadcast_to([1.0, 0.0, 0.0], (len(owner), len(self.readings), 3))
        p, x = values[:, : len(self.system.parameters)], np.zeros(len(self.system.states))
        if self._steady:
            found = self._gains.evaluate(np.zeros(1), x, np.zeros((1, u.shape[1])), p, self.c)[owner]
        else:
            found = self._gains.evaluate(np.zeros(1), x, u, p[owner], self.c[owner])
        return found.reshape(len(owner), len(self.readings), 3)

    @property
    def plain(self) -> bool:
        """Return whether every measured state is an output or its derivative as it is."""
        return all(reading.plain for reading in self.readings)

    @cached_property
    def _gains(self) -> Program:
        return Program.of(self.system, self._expressions)

    @cached_property
    def _steady(self) -> bool:
        """Whether gains, offsets and lags stay as they are in an experiment."""
        return not set().union(*(e.free_symbols for e in self._expressions)) & {TIME, *self.system.u}

    @property
    def _expressions(self) -> list[sp.Expr]:
        return [e for reading in self.readings for e in (reading.gain, reading.offset, reading.lag)]


def _alike(values: Array) -> tuple[Indices, Indices]:
    """First of the sets (experiments, sets, numbers) that are alike, and number of its like for every set."""
    if not values.shape[2] or values.shape[1] == 1:
        return np.zeros(1, np.int64), np.zeros(values.shape[1], np.int64)
    _, first, member = np.unique(values, axis=1, return_index=True, return_inverse=True)
    return first, member.ravel()


def _read(sensors: Sensors, reading: Reading, delay: float, lag: Array, rows: Rows) -> Array:
    """Return what an output shows of a state, shape (rows,), without the low-pass filter of its sensor.

    A quantity is the filtered one plus its slope times the lag, shape (rows,) or (1,). The slope of a
    quantity is read later by the lag instead, because a second derivative of a log is too noisy.
    """
    most = float(lag.max(initial=0.0))
    if reading.slope:
        return sensors.slope(reading.output, delay + most, rows)
    shown = sensors.shown(reading.output, delay, rows)
    return shown + lag * sensors.slope(reading.output, delay, rows) if most > 0.0 else shown
