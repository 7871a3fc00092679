"""Measured experiments cut into the free-run windows of the gap."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from unmodelled.base.arrays import Array, Indices, Mask
from unmodelled.diagnosis.data.gap import WHOLE, steps_of
from unmodelled.diagnosis.data.sensors import Sensors
from unmodelled.logs.logs import Logs

#: Fewest samples of a window that is cut short.
SHORTEST = 8


@dataclass(frozen=True, eq=False)
class Recording:
    """Free-run windows, back to back along some experiments; the last of each may be shorter."""

    logs: Logs  # of all experiments; their states are not used
    runs: tuple[int, ...]  # numbers of the experiments that are simulated
    start: Indices  # first samples, (windows,), where a simulation starts; the longest windows come first
    steps: Indices  # samples that are predicted, (windows,)
    sensors: Sensors
    latest: float  # longest delay of an output, samples; as many at the end of an experiment are in no window

    @classmethod
    def of(
        cls,
        logs: Logs,
        horizon: float,
        runs: Sequence[int] | None = None,
        latest: float = 0.0,
        sensors: Sensors | None = None,
    ) -> Recording:
        """Divide experiments into windows; the longest delay `latest` of an output is in s."""
        longest, runs = steps_of(horizon, logs), tuple(range(len(logs)) if runs is None else runs)
        held = math.floor(latest / logs.period + WHOLE)
        starts, lengths = [], []
        for i in runs:
            samples = int(logs.offsets[i + 1] - logs.offsets[i]) - held
            if samples < 2:
                raise ValueError(f"a delay must be shorter than experiment {logs.ids[i]}, got {latest:g} s")
            first, ahead = _starts(logs, i, samples, longest)
            starts.append(logs.offsets[i] + first)
            lengths.append(ahead)
        start, length = np.concatenate(starts), np.concatenate(lengths)
        order = np.argsort(-length, kind="stable")
        first, steps = (values[order].astype(np.int64) for values in (start, length))
        return cls(logs, runs, first, steps, sensors or Sensors(logs), latest / logs.period)

    @classmethod
    def whole(
        cls,
        logs: Logs,
        runs: Sequence[int] | None = None,
        latest: float = 0.0,
        sensors: Sensors | None = None,
    ) -> Recording:
        """Return every experiment as one window, from its first state to its end; `latest` in s."""
        return cls.of(logs, logs.period * float(np.diff(logs.offsets).max()), runs, latest, sensors)

    def begun(self, share: float) -> Recording:
        """Return the windows that start in the first part of their experiment."""
        since = self.start - self.logs.offsets[self.owner]
        mine = since < share * np.diff(self.logs.offsets)[self.owner]
        return replace(self, start=self.start[mine], steps=self.steps[mine])

    def thinned(self, count: int) -> Recording:
        """Return some of the windows, evenly from all experiments and at least one of each."""
        if len(self.start) <= count:
            return self
        order = np.argsort(self.start)
        every = order[:: -(-len(self.start) // count)]
        left = order[~np.isin(self.owner[order], self.owner[every])]
        _, first = np.unique(self.owner[left], return_index=True)
        every = np.sort(np.concatenate([every, left[first]]))
        return replace(self, start=self.start[every], steps=self.steps[every])

    def starting(self, start: Indices) -> Recording:
        """Return windows of the same length from other samples (windows,); the last may be shorter."""
        end = self.logs.offsets[self.logs.owner[start] + 1] - 1 - math.floor(self.latest + WHOLE)
        steps = np.minimum(self.steps.max(), end - start)
        order = np.argsort(-steps, kind="stable")[: np.count_nonzero(steps > 0)]
        return replace(self, start=start[order], steps=steps[order])

    def shortened(self, share: float) -> Recording:
        """Return the beginnings of the windows."""
        steps = max(SHORTEST, round(share * int(self.steps.max())))
        return replace(self, steps=np.minimum(self.steps, steps))

    @cached_property
    def owner(self) -> Indices:
        """Return the numbers, shape (windows,), of the windows' experiments."""
        return self.logs.owner[self.start]

    @cached_property
    def counted(self) -> Mask:
        """Return the mask, shape (windows, most steps), of predicted samples."""
        return np.asarray(np.arange(self.steps.max()) < self.steps[:, None])

    @cached_property
    def rows(self) -> Indices:
        """Return the predicted samples, shape (windows, most steps); after a window its last sample."""
        after = 1 + np.arange(self.steps.max())
        return np.asarray(self.start[:, None] + np.minimum(after, self.steps[:, None]))

    def left_out(self, later: Indices) -> Mask | None:
        """Return the mask, shape (windows, sets, most steps, outputs), of samples that are not compared.

        Takes the samples by which outputs are compared later (sets, outputs). None if all are compared.
        """
        if self.logs.left_out is None:
            return None
        rows = self.rows[:, None, :, None] + later[:, None]
        return np.asarray(self.logs.left_out[rows, np.arange(later.shape[1])])

    @property
    def compared(self) -> Indices:
        """Return the numbers, shape (windows, outputs), of predicted samples that are compared."""
        every = np.repeat(self.steps[:, None], len(self.logs.outputs), axis=1)
        beyond = self.left_out(np.zeros((1, len(self.logs.outputs)), np.int64))
        return every if beyond is None else every - (beyond[:, 0] & self.counted[:, :, None]).sum(axis=1)

    @property
    def scale(self) -> Array:
        """Return the standard deviation, shape (outputs,), within experiments, in units of the outputs."""
        return self.sensors.scale

    @property
    def noise(self) -> Array:
        """Return the standard deviation, shape (outputs,), of the sensor noise, in units of the outputs."""
        return self.sensors.noise


def _starts(logs: Logs, i: int, samples: int, longest: int) -> tuple[Indices, Indices]:
    """Return the starts (windows,) of the windows in an experiment, and their lengths, samples.

    A window starts where all outputs are measured: before a stay at the end of a range.
    """
    if logs.left_out is None or not logs.left_out[logs.rows(i)].any():
        first = np.arange(0, samples - 1, longest)
        return first, np.minimum(longest, samples - 1 - first)
    clear = np.flatnonzero(~logs.left_out[logs.rows(i)][: samples - 1].any(axis=1))
    found = clear[:1].tolist()
    while found and found[-1] + longest < samples - 1:
        following = int(np.searchsorted(clear, found[-1], "right"))
        following = max(following, int(np.searchsorted(clear, found[-1] + longest, "right")) - 1)
        if following == len(clear):
            break
        found.append(int(clear[following]))
    first = np.array(found, np.int64)
    return first, np.minimum(longest, np.diff(np.append(first, samples - 1)))
