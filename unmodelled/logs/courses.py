"""Whole records along which hidden states are integrated, also where a record was cut into experiments."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from unmodelled.logs.measurements import Measurements

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Stretch:
    """Successive experiments of one record, over which no number of the system changes."""

    owner: int  # number of the first of them
    last: int  # number of the last of them
    start: int  # filled sample
    steps: int  # filled samples that follow


@dataclass(frozen=True, eq=False)
class Courses:
    """Samples of experiments with the gaps between the parts of a record filled by straight lines."""

    logs: Measurements
    before: Indices  # (filled samples,), samples at or before them
    share: Array  # (filled samples,), of the way to the next sample
    first: Indices  # (experiments,), first filled samples

    @classmethod
    def of(cls, logs: Measurements) -> Courses:
        """Return the filled samples of experiments."""
        starts = logs.offsets[:-1]
        missing = [max(logs.gap(i) or 1, 1) - 1 for i in range(len(logs))]
        if not any(missing):
            return cls(logs, np.arange(len(logs.t)), np.zeros(len(logs.t)), starts)
        count = np.ones(len(logs.t), np.int64)
        count[starts[1:] - 1] += np.array(missing[1:], np.int64)
        before = np.repeat(np.arange(len(count)), count)
        number = np.arange(len(before)) - np.repeat(np.cumsum(count) - count, count)
        return cls(logs, before, number / count[before], starts + np.cumsum(missing))

    def filled(self, values: Array) -> Array:
        """Return the filled samples of tables (tables * samples, columns), in the same shape."""
        samples, columns = len(self.logs.t), values.shape[1]
        if len(self.before) == samples:
            return values
        tables = values.reshape(len(values) // samples, samples, columns)
        after = tables[:, np.minimum(self.before + 1, samples - 1)]
        between = tables[:, self.before] + self.share[:, None] * (after - tables[:, self.before])
        return between.reshape(-1, columns)

    def levels(self, runs: Iterable[int], numbers: Sequence[Array]) -> list[list[Stretch]]:
        """Return stretches of equal numbers (experiments, ...) to some experiments, first ones first."""
        levels: list[list[Stretch]] = []
        for record in self._records(set(runs)):
            changes = [i for i in record[1:] if any((a[i] != a[i - 1]).any() for a in numbers)]
            for level, (a, b) in enumerate(zip([record[0], *changes], [*changes, None], strict=True)):
                last = record[-1] if b is None else b - 1
                length = int(self.logs.offsets[last + 1] - self.logs.offsets[last]) - 1
                end = self.first[last] + length if b is None else self.first[b]
                stretch = Stretch(a, last, int(self.first[a]), int(end - self.first[a]))
                levels += [[]] if level == len(levels) else []
                levels[level].append(stretch)
        return levels

    def _records(self, wanted: set[int]) -> list[list[int]]:
        """Experiments of every record with a wanted one, up to the last wanted one."""
        records: list[list[int]] = []
        for i in range(len(self.logs)):
            if self.logs.gap(i) is None:
                records.append([i])
            else:
                records[-1].append(i)
        last = [max(wanted.intersection(record), default=-1) for record in records]
        return [
            [i for i in record if i <= end] for record, end in zip(records, last, strict=True) if end >= 0
        ]
