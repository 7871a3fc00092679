"""What a fit may change: parameters and delays, for all experiments or for each of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from unmodelled.diagnosis.fitting.simulation import Simulation
from unmodelled.systems.model import Parameter

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Unknown:
    """A number that is fitted.

    Attributes:
        name: of a parameter or delay. low, high: its bounds, SI. scale: a plausible size, SI.
        own: whether every experiment has a value of its own.
        prior: standard deviation around zero that is plausible before there are any data, SI.
    """

    name: str
    low: float
    high: float
    scale: float
    own: bool = False
    prior: float = np.inf

    @classmethod
    def of(cls, parameter: Parameter) -> Unknown:
        """A parameter of a system within its limits."""
        low, high = parameter.limits
        width = high - low if np.isfinite(high - low) else 1.0
        return cls(parameter.name, low, high, abs(parameter.value) or 0.1 * width)


@dataclass(frozen=True)
class Unknowns:
    """Unknowns side by side in one vector: those that all experiments share have one entry, others one each.

    Attributes:
        simulation: whose numbers they are. each: the unknowns.
    """

    simulation: Simulation
    each: tuple[Unknown, ...]

    @cached_property
    def unknown(self) -> Indices:
        """(entries,) which of the unknowns."""
        runs = len(self.simulation.recording.runs)
        return np.repeat(np.arange(len(self.each)), [runs if u.own else 1 for u in self.each])

    @cached_property
    def entry(self) -> Indices:
        """(windows, unknowns) the entry that counts in a window."""
        recording = self.simulation.recording
        run = np.searchsorted(np.sort(recording.runs), recording.owner)
        first = np.searchsorted(self.unknown, np.arange(len(self.each)))
        return np.asarray(first + np.outer(run, [u.own for u in self.each]))

    @cached_property
    def scale(self) -> Array:
        """(entries,) of the values that the vector counts in."""
        return np.array([self.each[k].scale for k in self.unknown])

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """(entries,) lowest and highest values of the vector."""
        low, high = (np.array([getattr(self.each[k], end) for k in self.unknown]) for end in ("low", "high"))
        return low / self.scale, high / self.scale

    @cached_property
    def precision(self) -> Array:
        """(entries,) inverse variance of what is plausible before there are any data."""
        prior = np.array([self.each[k].prior for k in self.unknown])
        return np.asarray((self.scale / prior) ** 2)

    def vector(self, start: Mapping[str, float]) -> Array:
        """(entries,) at values, those of the system unless given, within the bounds."""
        known = dict(zip(self.simulation.names, self.simulation.values.tolist(), strict=True)) | dict(start)
        values = np.array([known[u.name] for u in self.each])
        return np.clip(values[self.unknown] / self.scale, *self.bounds)

    def numbers(self, z: Array) -> Array:
        """(experiments, sets, numbers) that `Simulation` takes, from vectors (sets, entries)."""
        recording = self.simulation.recording
        values = np.tile(self.simulation.values, (len(recording.logs), len(z), 1))
        for k, unknown in enumerate(self.each):
            column = self.simulation.names.index(unknown.name)
            rows = np.sort(recording.runs) if unknown.own else slice(None)
            values[rows, :, column] = (z * self.scale)[:, self.unknown == k].T
        return values
