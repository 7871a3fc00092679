"""Measured experiments cut into the free-run windows of the gap (shared/contracts/diagnosis.md)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from unmodelled.diagnosis.data.gap import WHOLE, steps_of
from unmodelled.diagnosis.data.sensors import Sensors
from unmodelled.logs.logs import Logs

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Recording:
    """Windows of `steps` samples back to back along some experiments; the last one of each may be shorter.

    Attributes:
        logs: all experiments; its states do not count. runs: those that are simulated.
        start: (windows,) first samples, where a simulation starts. steps: (windows,) samples that follow. The
            longest windows come first.
        sensors: what the outputs of all experiments show, and how noisy they are.
        latest: the longest delay of an output, samples; so many whole ones at the end of an experiment belong
            to no window.
    """

    logs: Logs
    runs: tuple[int, ...]
    start: Indices
    steps: Indices
    sensors: Sensors
    latest: float

    @classmethod
    def of(
        cls,
        logs: Logs,
        horizon: float,
        runs: Sequence[int] | None = None,
        latest: float = 0.0,
        sensors: Sensors | None = None,
    ) -> Recording:
        """Windows of `horizon` seconds.

        Args:
            logs: the experiments. horizon: s, rounded to samples. runs: which of them; all unless given.
            latest: the longest delay of an output, s; the last part of an experiment shows no states.
            sensors: of these experiments, where they are known already.

        Raises:
            BadInput: when the horizon is not a positive number.
            ValueError: when `latest` is as long as an experiment.
        """
        longest, runs = steps_of(horizon, logs), tuple(range(len(logs)) if runs is None else runs)
        held = math.floor(latest / logs.period + WHOLE)
        starts, lengths = [], []
        for i in runs:
            samples = int(logs.offsets[i + 1] - logs.offsets[i]) - held
            if samples < 2:
                raise ValueError(f"a delay must be shorter than experiment {logs.ids[i]}, got {latest:g} s")
            first = np.arange(0, samples - 1, longest)
            starts.append(logs.offsets[i] + first)
            lengths.append(np.minimum(longest, samples - 1 - first))
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
        """Return every experiment as one window, from its first state to its end; arguments as in `of`."""
        return cls.of(logs, logs.period * float(np.diff(logs.offsets).max()), runs, latest, sensors)

    def among(self, runs: Sequence[int]) -> Recording:
        """The windows of some of the experiments."""
        mine = np.isin(self.owner, runs)
        return replace(self, runs=tuple(runs), start=self.start[mine], steps=self.steps[mine])

    def thinned(self, count: int) -> Recording:
        """The same with at most `count` of the windows, from everywhere."""
        if len(self.start) <= count:
            return self
        every = np.sort(np.argsort(self.start)[:: -(-len(self.start) // count)])
        return replace(self, start=self.start[every], steps=self.steps[every])

    @cached_property
    def owner(self) -> Indices:
        """(windows,) their experiments."""
        return self.logs.owner[self.start]

    @cached_property
    def counted(self) -> NDArray[np.bool_]:
        """(windows, most steps) which predictions there are."""
        return np.asarray(np.arange(self.steps.max()) < self.steps[:, None])

    @cached_property
    def rows(self) -> Indices:
        """(windows, most steps) the samples that are predicted; after the end of a window its last one."""
        after = 1 + np.arange(self.steps.max())
        return np.asarray(self.start[:, None] + np.minimum(after, self.steps[:, None]))

    @property
    def scale(self) -> Array:
        """(outputs,) standard deviation within all experiments, in its unit; see `output_scale`."""
        return self.sensors.scale

    @property
    def noise(self) -> Array:
        """(outputs,) standard deviation of the sensors' noise, the same for all experiments."""
        return self.sensors.noise
