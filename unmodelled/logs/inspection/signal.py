"""Signals of a log with their roles in the system file, one run of them, and what is found in it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
from scipy.ndimage import maximum_filter1d, median_filter

from unmodelled.base.arrays import Array, Mask
from unmodelled.logs.differentiate import noise, quantum
from unmodelled.systems.model import Output, System
from unmodelled.systems.units import LoggedUnit

#: What a signal is: a function of positions, which cannot jump; a function of states; another output, such as
#: an acceleration, which an impact makes large; an input.
Role = Literal["position", "state", "other", "input"]

#: Width of the median that removes up to three samples, and reach of the largest step around a sample.
MEDIAN, REACH = 7, 13
#: Share of the samples at either end of a range that do not count: spikes may be among them.
SHARE = 0.05


@dataclass(frozen=True)
class Signal:
    """A channel of the logs."""

    name: str  # in the system file
    column: str  # of the log
    unit: str  # SI
    role: Role
    measured: bool = True  # whether a sensor shows it: an output, or an input that is no command
    held: bool = False  # whether it is an input that keeps its value until the next sample
    written: LoggedUnit | None = None  # unit of the column, where it is not `unit`

    @property
    def zero(self) -> float:
        """Return the value where the column is zero, SI."""
        return 0.0 if self.written is None else self.written.offset

    def shown(self, value: float) -> str:
        """Return a value in the unit of the column."""
        written = self.written or LoggedUnit(self.unit, 1.0, 0.0)
        number = (value - written.offset) / written.factor
        return f"{number:.4g}" if written.text.strip() in ("", "1", "-") else f"{number:.4g} {written.text}"


def signals_of(system: System) -> tuple[Signal, ...]:
    """Return the channels of a system with their roles, outputs first; not inputs that no equation uses."""
    positions = {x for x, speed in zip(system.x, system.dynamics, strict=True) if speed in system.x}
    used = _used(system)
    outputs = (
        Signal(o.name, o.column, o.unit, _role(o, system, positions), written=o.logged)
        for o in system.outputs
    )
    inputs = (
        Signal(i.name, i.column, i.unit, "input", not i.commanded, i.hold, i.logged)
        for i in system.inputs
        if i.name in used
    )
    return tuple({signal.column: signal for signal in (*inputs, *outputs)}.values())


def _used(system: System) -> set[str]:
    """Return the names that the equations of a system read."""
    read = [*system.dynamics, *system.signals.values(), *(o.expression for o in system.outputs)]
    read += [s.initial for s in system.states] + [p.law for p in system.ports if p.law is not None]
    read += [each for e in system.events for each in (e.expression, *(e.then or ()))]
    named = {name for p in system.ports for name in (*p.coordinates, p.load) if name is not None}
    return named | {each.name for expression in read for each in expression.free_symbols}


def _role(output: Output, system: System, positions: set[object]) -> Role:
    known = {parameter.name for parameter in system.parameters}
    known |= {constant.name for constant in system.operating_point}
    read = {each for each in output.expression.free_symbols if each.name not in known}
    if not read or not read <= set(system.x):
        return "other"
    return "position" if read <= positions else "state"


@dataclass(frozen=True, eq=False)
class Course:
    """The samples of one channel in one run."""

    values: Array  # (samples,), SI

    @cached_property
    def smooth(self) -> Array:
        """Return the running median, shape (samples,), without excursions of up to three samples."""
        return np.asarray(median_filter(self.values, MEDIAN, mode="nearest"))

    @cached_property
    def steps(self) -> Array:
        """Return the largest step of `smooth` around every sample, shape (samples,), not below the noise."""
        change = np.abs(np.diff(self.smooth, prepend=self.smooth[:1]))
        return np.asarray(np.maximum(maximum_filter1d(change, REACH, mode="nearest"), self.grain))

    @cached_property
    def grain(self) -> float:
        """Return the larger one of the noise and the step of quantised values."""
        return max(noise(self.smooth), noise(self.values), quantum(self.values), self._rounding)

    @property
    def _rounding(self) -> float:
        return 1e-9 * float(np.ptp(self.smooth)) + 1e-300


@dataclass(frozen=True, eq=False)
class Run:
    """One experiment as logged."""

    name: str  # id of the experiment
    t: Array  # (samples,), s
    values: Mapping[str, Array]  # (samples,) by column, SI
    signals: tuple[Signal, ...]
    spans: Mapping[str, float]  # usual range by column in the run in which it moves furthest, SI

    def course(self, signal: Signal) -> Course:
        """Return the samples of a channel."""
        return Course(self.values[signal.column])

    def with_values(self, signal: Signal, values: Array) -> Run:
        """Return the run with other samples (samples,) of one channel."""
        return replace(self, values={**self.values, signal.column: values})

    def without(self, rows: Mask) -> Run:
        """Return the run without some samples (samples,) of all channels."""
        kept = {column: values[~rows] for column, values in self.values.items()}
        return replace(self, t=self.t[~rows], values=kept)


@dataclass(frozen=True)
class Finding:
    """A fault of one channel in one run."""

    kind: str  # such as "spikes"
    channel: str  # name in the system file
    run: str  # id of the experiment
    count: int  # samples, jumps or stretches
    first: float  # time of the first one since the start of the run, s
    what: str  # after the channel's name, with {count} for the number over all runs
    cure: str  # what was done, a main clause; what to do where nothing was done
    cured: bool = True


def spans_of(signals: tuple[Signal, ...], logs: Sequence[Mapping[str, Array]]) -> dict[str, float]:
    """Return the largest range of every column (samples,) of the logs without its most extreme samples."""
    ends = [SHARE, 1.0 - SHARE]
    return {
        s.column: max(float(np.diff(np.quantile(log[s.column], ends))[0]) for log in logs) for s in signals
    }
