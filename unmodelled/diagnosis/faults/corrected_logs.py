"""Corrections of logs: unit, sign, offset, clock, or a column that is replaced."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from unmodelled.base.arrays import Array, Indices, Mask
from unmodelled.diagnosis.data.sensors import Sensors, SmoothedSlope
from unmodelled.logs.clock import Kind, read_at
from unmodelled.logs.logs import Logs
from unmodelled.logs.preparation import with_delays
from unmodelled.systems.model import System


@dataclass(frozen=True, eq=False)
class Correction:
    """A correction of logs: gain * output + offset, drive * input, clock * time."""

    gain: Array  # of the outputs, (experiments, outputs)
    offset: Array  # (experiments, outputs), in the unit of the corrected output
    drive: Array  # of the inputs, (experiments, inputs)
    clock: Array  # of time, (experiments,)
    inputs: Array | None = None  # replace the logged ones, (samples, inputs); nan where these stay
    outputs: Array | None = None  # replace the logged ones, (samples, outputs); nan where these stay
    owner: Indices | None = None  # experiment of every sample of `inputs` and `outputs`, (samples,)

    @classmethod
    def none(cls, logs: Logs) -> Correction:
        """Return the correction that changes nothing."""
        outputs, inputs = (len(logs), len(logs.outputs)), (len(logs), len(logs.inputs))
        return cls(np.ones(outputs), np.zeros(outputs), np.ones(inputs), np.ones(len(logs)))

    @classmethod
    def replaced(cls, logs: Logs, inputs: Array) -> Correction:
        """Return the correction that replaces all inputs (samples, inputs)."""
        return replace(cls.none(logs), inputs=inputs, owner=logs.owner)

    @classmethod
    def exchanged(cls, logs: Logs, one: int, other: int) -> Correction:
        """Return the correction that exchanges two outputs, by their numbers."""
        order = np.arange(len(logs.outputs))
        order[[one, other]] = order[[other, one]]
        return replace(cls.none(logs), outputs=logs.y[:, order], owner=logs.owner)

    @classmethod
    def exchanged_input(cls, logs: Logs, source: int, output: int) -> Correction:
        """Return the correction that exchanges an input and an output, by their numbers."""
        u, y = logs.u.copy(), logs.y.copy()
        u[:, source], y[:, output] = logs.y[:, output], logs.u[:, source]
        return replace(cls.none(logs), inputs=u, outputs=y, owner=logs.owner)

    def read_outputs(self, logs: Logs) -> Array:
        """Return the outputs (samples, outputs) before gain and offset: as logged, or replaced."""
        return _replaced(logs.y, self.outputs)

    def only(self, runs: Mask) -> Correction:
        """Restrict the correction to some experiments: mask (experiments,)."""
        mine = runs[:, None]
        return replace(
            self,
            gain=np.where(mine, self.gain, 1.0),
            offset=np.where(mine, self.offset, 0.0),
            drive=np.where(mine, self.drive, 1.0),
            clock=np.where(runs, self.clock, 1.0),
            inputs=self._where(runs, self.inputs),
            outputs=self._where(runs, self.outputs),
        )

    def _where(self, runs: Mask, values: Array | None) -> Array | None:
        """Values (samples, n) that replace logged ones, in some experiments (experiments,) only."""
        return None if values is None else np.where(runs[self.owner][:, None], values, np.nan)

    @property
    def corrected(self) -> Mask:
        """Return the mask, shape (experiments,), of changed experiments."""
        changed = (self.gain != 1.0) | (self.offset != 0.0)
        changed = changed.any(axis=1) | (self.drive != 1.0).any(axis=1) | (self.clock != 1.0)
        for values in (self.inputs, self.outputs):
            if values is not None and self.owner is not None:
                changed[self.owner[np.isfinite(values).any(axis=1)]] = True
        return np.asarray(changed)

    @property
    def common(self) -> float:
        """Return the factor of the sampling period; experiments with another factor are resampled to it."""
        return float(np.sort(self.clock)[len(self.clock) // 2])

    def logs(self, system: System, logs: Logs) -> Logs:
        """Return the corrected logs."""
        y = self.gain[logs.owner] * self.read_outputs(logs) + self.offset[logs.owner]
        common = self.common
        period = common * logs.period
        # the delays of the inputs were applied on the clock of the file
        late = tuple(common * delay for delay in logs.delays)
        u = self.drive[logs.owner] * _replaced(logs.u, self.inputs)
        corrected = replace(logs, y=y, u=u, t=common * logs.t, period=period, delays=late)
        if self.outputs is not None or (self.gain != 1.0).any() or (self.offset != 0.0).any():
            corrected = replace(corrected, limits={})  # the ends are those of the values as logged
        corrected = with_delays(system, corrected)
        if (self.clock == common).all():
            return corrected
        lengths = [len(self._instants(logs, i)) for i in range(len(logs))]
        return replace(
            corrected,
            y=self._read(y, logs, "cubic"),
            u=self._read(corrected.u, logs, "linear"),
            x=self._read(logs.x, logs, "linear"),
            t=period * np.concatenate([np.arange(n) for n in lengths]),
            offsets=np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64),
        )

    def sensors(self, logs: Logs, measured: Sensors) -> Sensors:
        """Return the sensors of corrected logs."""
        if self.outputs is not None:
            return Sensors(logs)
        if (self.gain == 1.0).all() and (self.offset == 0.0).all() and (self.clock == 1.0).all():
            return measured  # inputs alone are corrected; what is known of the outputs stays so
        before = measured.logs
        gain, offset, clock = (each[before.owner] for each in (self.gain, self.offset, self.clock))

        def slope(j: int, s: SmoothedSlope) -> SmoothedSlope:
            both = np.column_stack([gain[:, j] * s.y + offset[:, j], gain[:, j] * s.v / clock])
            if not (self.clock == self.common).all():
                both = self._read(both, before, "cubic")
            return SmoothedSlope(both[:, 0], both[:, 1], s.width)

        slopes = {j: slope(j, s) for j, s in measured.slopes.items()}
        return Sensors(logs, slopes=slopes)

    def samples(self, samples: Indices, logs: Logs, corrected: Logs) -> Indices:
        """Return the samples (n,) of corrected logs nearest to the instants of given samples (n,)."""
        owner = logs.owner[samples]
        since = (samples - logs.offsets[owner]) * (self.clock[owner] / self.common)
        moved = corrected.offsets[owner] + np.rint(since).astype(np.int64)
        return np.minimum(moved, corrected.offsets[owner + 1] - 1)

    def _instants(self, logs: Logs, i: int) -> Array:
        """Samples of experiment `i`, counted on its own clock, that the common clock reads."""
        ratio, last = float(self.clock[i]) / self.common, float(np.diff(logs.offsets)[i] - 1)
        return np.minimum(np.arange(int(last * ratio + 1e-9) + 1) / ratio, last)

    def _read(self, values: Array, logs: Logs, kind: Kind) -> Array:
        """Columns (samples, n) of all experiments on the common clock."""
        parts = []
        for i in range(len(logs)):
            part, instants = values[logs.rows(i)], self._instants(logs, i)
            if self.clock[i] != self.common:
                k = np.arange(len(part), dtype=np.float64)
                read = [read_at(k, column, instants, kind) for column in part.T]
                part = np.column_stack([np.empty((len(instants), 0)), *read])  # a system may have no inputs
            parts.append(part)
        return np.concatenate(parts)


def _replaced(logged: Array, values: Array | None) -> Array:
    """Return columns (samples, n) of which some cells are replaced."""
    return logged if values is None else np.where(np.isnan(values), logged, values)
