"""Free runs of a system over the windows of a recording, for many sets of parameters at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np
import sympy as sp

from unmodelled.base.arrays import Array, Indices, Mask
from unmodelled.diagnosis.data.gap import WHOLE
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.data.window_tables import WindowTableReader
from unmodelled.diagnosis.fitting import error_kernels
from unmodelled.engine.free_run import Backend, Integration, Windows, free_run
from unmodelled.engine.machine.program import Program
from unmodelled.logs.clock import EVERY, Rows
from unmodelled.logs.observer import Observer
from unmodelled.logs.readings import hidden_states
from unmodelled.systems.model import System

#: Lengths of windows after which hidden states may have forgotten how they started, and the share of their
#: spread that counts as forgotten.
MEMORY, FORGOTTEN = (1, 3), 1e-3

#: Prepares a system and expressions that are observed of it for integration.
MakeBackend = Callable[[System, Sequence[sp.Expr]], Backend]


@dataclass(frozen=True)
class Runs:
    """Simulated and measured outputs of all windows."""

    #: Simulated, from the second sample of a window on; nan after its end, not finite where it diverged.
    y: Array  # (windows, sets, most steps, outputs)
    measured: Array  # at the same samples, (windows, sets or 1, most steps, outputs)
    counted: Mask  # samples before the end of a window, (windows, most steps)
    first: Array  # simulated at the first sample of a window, without delay, (windows, sets, outputs)
    #: Samples of the first set that are not compared, (windows, most steps, outputs): `measured` is `y`.
    left_out: Mask | None = None

    def errors(self, scale: Array) -> Array:
        """Return the errors (windows, most steps, outputs) of the first set; not finite where it diverged."""
        with np.errstate(all="ignore"):
            return np.asarray((self.y[:, 0] - self.measured[:, 0]) / scale)

    @property
    def diverged(self) -> Mask:
        """Return the mask, shape (windows, sets), of windows in which an output has no finite value."""
        return np.asarray((~np.isfinite(self.y).all(-1) & self.counted[:, None]).any(-1))


class Simulation:
    """Simulate a system over the windows of a recording.

    A parameter set is the parameters of the system, in its order, and then the delays. A window starts at the
    states that the outputs measure under this set; a state that no output measures is integrated from the
    start of the experiment, with the measured states imposed.

    Args:
        system: system with the laws of its ports.
        recording: windows; their logs have the inputs and outputs of `system`.
        delays: names of the inputs or outputs that further numbers delay (s), by name of the number. They are
            added to the delays of the system; the recording must leave them room, see `Recording.of`.
        c: operating points, shape (experiments, constants), default those of the logs.
        backend: function that prepares a system and the expressions of its outputs for integration, default
            the register machine; `Generated.of` makes a compiled kernel.

    Attributes:
        measured: numbers of the states that outputs measure.
        hidden: numbers of the other states.
        memory: samples before a window from which they are integrated, None for all; see `forgetting`.
    """

    def __init__(
        self,
        system: System,
        recording: Recording,
        delays: Mapping[str, str] | None = None,
        c: Array | None = None,
        backend: MakeBackend = Program.of,
    ) -> None:
        self.system, self.recording, self.delays = system, recording, dict(delays or {})
        self.c = recording.logs.c if c is None else c
        self.equations = backend(system, [output.expression for output in system.outputs])
        inputs, outputs = ([item.name for item in items] for items in (system.inputs, system.outputs))
        self.reader = WindowTableReader(system, self._delayed(inputs), self._delayed(outputs), self.c)
        shown = self.reader.readings
        self.measured = [reading.state for reading in shown]
        self.hidden = hidden_states(system, shown)
        self.memory: int | None = None
        # of the states that no output shows, driven by the inputs and all other states
        self._observer = Observer.of(system, shown) if self.hidden else None
        beside = [reading.beside for reading in shown]
        self._beside = Program.of(system, beside) if any(beside) else None

    def over(self, recording: Recording) -> Simulation:
        """Return the simulation of the same system over other windows.

        Args:
            recording: windows of the same experiments.
        """
        other = copy(self)
        other.recording = recording
        return other

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the numbers of a parameter set."""
        return (*(p.name for p in self.system.parameters), *self.delays)

    @property
    def values(self) -> Array:
        """Return the parameter set, shape (numbers,), of the system as given."""
        return np.array([*self.system.values, *(0.0 for _ in self.delays)])

    def __call__(self, values: Array, moved: Array | None = None, substeps: int = 1) -> Runs:
        """Simulate all windows.

        Args:
            values: parameter sets, shape (experiments or 1, sets, numbers), SI.
            moved: summands of the initial states, shape (windows, sets, measured states, or these and then
                the hidden ones), SI, default none.
            substeps: integration steps (Runge-Kutta, order four) per sample, default 1.
        """
        record, sets = self.recording, values.shape[1]
        everywhere = np.broadcast_to(values, (len(record.logs), *values.shape[1:]))
        tables = self.reader(everywhere, record, record.start)
        p = everywhere[:, :, : len(self.system.parameters)]
        x0 = np.empty((len(record.start), sets, len(self.system.states)))
        x0[:, :, self.measured] = tables.x[tables.member].swapaxes(0, 1)
        if self.hidden:
            x0[:, :, self.hidden] = self.hidden_starts(everywhere, substeps)
        if moved is not None:
            x0[:, :, [*self.measured, *self.hidden][: moved.shape[2]]] += moved
        if self._beside is not None:
            unread, at = np.zeros(len(self.system.inputs)), record.owner
            beside = self._beside.evaluate(np.zeros(1), x0, unread, p[at], self.c[at][:, None])
            x0[:, :, self.measured] -= beside
        windows = Windows(
            tables.u.reshape(tables.u.shape[0] * tables.u.shape[1], tables.u.shape[2]),
            *(record.logs.t, record.start, record.steps, record.owner, tables.shift),
        )
        hold = tuple(item.course for item in self.system.inputs)
        how = Integration(record.logs.period, "rk4", substeps, hold)
        y = free_run(self.equations, windows, p, self.c, x0, how)
        return self._shown(y, values[0])

    def hidden_starts(self, values: Array, substeps: int = 1) -> Array:
        """Return the states that no output measures at the first samples of the windows.

        Args:
            values: parameter sets, shape (experiments or 1, sets, numbers), SI.
            substeps: integration steps (Runge-Kutta, order four) per sample, default 1.

        Returns:
            States, shape (windows, sets, hidden states), SI.
        """
        record, observer = self.recording, self._observer
        assert observer is not None
        logs, inputs = record.logs, len(self.system.inputs)
        everywhere = np.broadcast_to(values, (len(logs), *values.shape[1:]))
        p = everywhere[:, :, : len(self.system.parameters)]
        # they are driven by the measured states before the windows
        back = record.start - logs.offsets[record.owner]
        rows: Rows = EVERY
        if self.memory is not None:
            back = np.minimum(back, self.memory)
            rows = recent = self._recent(back)
        shown = [k - inputs for k in observer.columns if k >= inputs]
        tables = self.reader(everywhere, record, rows, shown)
        acting = tables.u[:, rows][:, :, [k for k in observer.columns if k < inputs]]
        driven = np.concatenate([acting[tables.acting], tables.x], axis=2)
        shift, driven = tables.member * driven.shape[1], driven.reshape(-1, driven.shape[2])
        # and depend on a few of the numbers only: sets that are alike in those are integrated once
        numbers = np.column_stack([*p[:, :, observer.parameters], shift])
        _, different, alike = np.unique(numbers, axis=0, return_index=True, return_inverse=True)
        shift, p = shift[different], p[:, different]
        if self.memory is None:
            z = observer.states(logs, driven, shift, (record.owner, back), p, self.c, substeps)
        else:
            begin = np.searchsorted(recent, record.start - back)
            windows = Windows(driven, logs.t[recent], begin, back, record.owner, shift)
            z = observer.shortly_before(windows, p, self.c, logs, substeps)
        return z[:, alike.ravel()]

    def _recent(self, back: Indices) -> Indices:
        """Numbers of the samples so far before the windows, up to their first ones."""
        needed = np.zeros(len(self.recording.logs.t), np.bool_)
        for start, steps in zip(self.recording.start, back, strict=True):
            needed[start - steps : start + 1] = True
        return np.flatnonzero(needed)

    def forgetting(self, values: Array, substeps: int = 1) -> Simulation:
        """Return the simulation that integrates hidden states from shortly before every window.

        This is as good where they have forgotten by then how they started: a lag does, a store may not. It
        saves most of the time of a fit to few windows of long logs.

        Args:
            values: parameter set, shape (experiments or 1, 1, numbers), SI.
            substeps: integration steps per sample, default 1.

        Returns:
            Such a simulation, or one that integrates them from the start of every experiment.
        """
        whole = copy(self)
        whole.memory = None
        if not self.hidden or any(self.recording.logs.continues):
            return whole
        z = whole.hidden_starts(values, substeps)
        for windows in MEMORY:
            short = copy(self)
            short.memory = windows * int(self.recording.steps.max())
            with np.errstate(invalid="ignore"):  # where they diverge
                off = np.abs(short.hidden_starts(values, substeps) - z)
                forgotten = bool(np.all(off <= FORGOTTEN * z.std(axis=0)))
            if forgotten:
                return short
        return whole

    def forgets_before(self, other: Simulation) -> bool:
        """Return whether hidden states are integrated from fewer samples than in another simulation.

        Args:
            other: simulation of the same system.
        """
        return self.memory is not None and (other.memory is None or self.memory < other.memory)

    def later(self, values: Array) -> Indices:
        """Return the whole samples by which delayed outputs are compared later.

        Sets that hardly differ are compared at the same samples, or they would differ by their noise.

        Args:
            values: parameter sets, shape (sets, numbers), SI.

        Returns:
            Numbers of samples, shape (sets, outputs).

        Raises:
            ValueError: when a delay is negative, or longer than the recording leaves room for.
        """
        late, latest = self._late(values), self.recording.latest
        if not (late.min() >= 0.0 and late.max() <= latest + WHOLE):
            raise ValueError(f"delays must be from 0 to {latest:g} samples, got {late.tolist()}")
        whole = np.floor(late + (0.25 if len(late) > 1 else WHOLE))
        whole = np.minimum(whole, np.floor(latest + WHOLE))
        return np.where(np.abs(late - late[0]) < 0.5, whole[0], whole).astype(np.int64)

    def _late(self, values: Array) -> Array:
        """Delays (sets, outputs) of the outputs, samples."""
        return self.reader.delays(values) / self.recording.logs.period

    def _shown(self, y: Array, values: Array) -> Runs:
        """Return outputs (windows, sets, samples, outputs) as delayed sensors show them."""
        record, later = self.recording, self.later(values)
        rest = self._late(values) - later
        rest[np.abs(rest) <= WHOLE] = 0.0
        shown = error_kernels.delayed_values(y, rest, record.steps) if rest.any() else y[:, :, 1:]
        shifts = later[:1] if (later == later[0]).all() else later
        rows = record.rows[:, None, :, None] + shifts[:, None]
        measured = record.logs.y[rows, np.arange(y.shape[3])]
        beyond = record.left_out(shifts)
        if beyond is not None:  # no error, whatever is simulated
            measured = np.where(beyond, shown, measured)
        return Runs(shown, measured, record.counted, y[:, :, 0], None if beyond is None else beyond[:, 0])

    def _delayed(self, names: Sequence[str]) -> dict[int, int]:
        """Number of an input or output -> column of its delay."""
        columns = {name: len(self.system.parameters) + k for k, name in enumerate(self.delays.values())}
        return {j: columns[name] for j, name in enumerate(names) if name in columns}
