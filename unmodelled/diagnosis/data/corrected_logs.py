"""Logs as they would be without a fault of unit, sign, offset or clock, or without a copied column."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from unmodelled.diagnosis.data.sensors import Sensors, SmoothedSlope
from unmodelled.logs.clock import Kind, read_at
from unmodelled.logs.logs import Logs
from unmodelled.logs.preparation import with_delays
from unmodelled.systems.model import System

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Correction:
    """A correction of logs: gain * output + offset, drive * input, clock * time.

    Attributes:
        gain, offset: (experiments, outputs), the offset in the unit of the corrected output.
        drive: (experiments, inputs). clock: (experiments,) factors of time.
        columns: number of an output -> (samples,) what is put in its place first.
    """

    gain: Array
    offset: Array
    drive: Array
    clock: Array
    columns: Mapping[int, Array] = field(default_factory=dict)

    @classmethod
    def none(cls, logs: Logs) -> Correction:
        """Leave the logs as they are."""
        outputs, inputs = (len(logs), len(logs.outputs)), (len(logs), len(logs.inputs))
        return cls(np.ones(outputs), np.zeros(outputs), np.ones(inputs), np.ones(len(logs)))

    def only(self, runs: Mask) -> Correction:
        """Correct some experiments (experiments,) and leave the others; columns are those of all."""
        mine = runs[:, None]
        return replace(
            self,
            gain=np.where(mine, self.gain, 1.0),
            offset=np.where(mine, self.offset, 0.0),
            drive=np.where(mine, self.drive, 1.0),
            clock=np.where(runs, self.clock, 1.0),
        )

    @property
    def corrected(self) -> Mask:
        """(experiments,) those that it changes."""
        changed = (self.gain != 1.0) | (self.offset != 0.0)
        several = changed.any(axis=1) | (self.drive != 1.0).any(axis=1) | (self.clock != 1.0)
        return np.asarray(several | bool(self.columns))

    @property
    def common(self) -> float:
        """The factor of the sampling period; experiments with another one are put on the common clock."""
        return float(np.sort(self.clock)[len(self.clock) // 2])

    def logs(self, system: System, logs: Logs) -> Logs:
        """Return corrected logs of `system`; the estimated states are left as they are."""
        y = logs.y.copy()
        for j, column in self.columns.items():
            y[:, j] = column
        y = self.gain[logs.owner] * y + self.offset[logs.owner]
        common = self.common
        period = common * logs.period
        # the delays of the inputs were applied on the clock of the file
        late = tuple(common * delay for delay in logs.delays)
        corrected = replace(
            logs, y=y, u=self.drive[logs.owner] * logs.u, t=common * logs.t, period=period, delays=late
        )
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
        """Return what the outputs of corrected `logs` show; slopes are corrected, not estimated anew.

        Only those of replaced columns are.
        """
        before = measured.logs
        gain, offset, clock = (each[before.owner] for each in (self.gain, self.offset, self.clock))

        def slope(j: int, s: SmoothedSlope) -> SmoothedSlope:
            both = np.column_stack([gain[:, j] * s.y + offset[:, j], gain[:, j] * s.v / clock])
            if not (self.clock == self.common).all():
                both = self._read(both, before, "cubic")
            return SmoothedSlope(both[:, 0], both[:, 1], s.width)

        slopes = {j: slope(j, s) for j, s in measured.slopes.items() if j not in self.columns}
        return Sensors(logs, slopes=slopes)

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
                part = np.stack([read_at(k, column, instants, kind) for column in part.T], axis=1)
            parts.append(part)
        return np.concatenate(parts)
