"""Numbers that are fitted: parameters and delays, shared by all experiments or one for each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from unmodelled.base.arrays import Array, Indices
from unmodelled.diagnosis.fitting.simulation import Simulation
from unmodelled.systems.model import Parameter

#: Values by name, SI, of a number that differs between experiments by name and id.
Start = Mapping[str, float | Mapping[str, float]]


@dataclass(frozen=True)
class Unknown:
    """A number that is fitted."""

    name: str  # of a parameter or delay
    low: float  # SI
    high: float  # SI
    scale: float  # plausible size, SI
    own: bool = False  # whether every experiment has a value of its own
    #: Whether a state that no output measures starts there. Such a number is no finding: it is fitted to the
    #: experiment that is predicted, as the measured initial states are.
    start: bool = False
    prior: float = np.inf  # standard deviation of the prior around `middle`, SI
    middle: float = 0.0  # value at which the entry of the vector is zero, SI

    @classmethod
    def of(cls, parameter: Parameter) -> Unknown:
        """Return the unknown of a parameter, within its limits."""
        low, high = parameter.limits
        width = high - low if np.isfinite(high - low) else 1.0
        own = parameter.per_experiment
        return cls(parameter.name, low, high, abs(parameter.value) or 0.1 * width, own, start=own)

    def bound(self, value: float, share: float) -> float | None:
        """Return the bound, SI, that a value has reached, None where it is within the bounds."""
        for end in (self.low, self.high):
            if abs(value - end) <= share * min(self.high - self.low, max(abs(end), self.scale)) < np.inf:
                return end
        return None


@dataclass(frozen=True)
class Unknowns:
    """Arrange unknowns in one vector: a shared one has one entry, another one an entry per experiment."""

    simulation: Simulation
    each: tuple[Unknown, ...]  # in the order of the vector

    @cached_property
    def unknown(self) -> Indices:
        """Return the unknown, shape (entries,), of every entry."""
        runs = len(self.simulation.recording.runs)
        return np.repeat(np.arange(len(self.each)), [runs if u.own else 1 for u in self.each])

    @cached_property
    def entry(self) -> Indices:
        """Return the entry, shape (windows, unknowns), of every unknown in every window."""
        recording = self.simulation.recording
        run = np.searchsorted(np.sort(recording.runs), recording.owner)
        first = np.searchsorted(self.unknown, np.arange(len(self.each)))
        own = np.array([u.own for u in self.each], dtype=np.int64)  # of no unknowns, an index too
        return np.asarray(first + np.outer(run, own))

    @cached_property
    def scale(self) -> Array:
        """Return the unit, shape (entries,), of the vector, SI."""
        return np.array([self.each[k].scale for k in self.unknown])

    @cached_property
    def middle(self) -> Array:
        """Return the values, shape (entries,), at which the vector is zero, SI."""
        return np.array([self.each[k].middle for k in self.unknown])

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Return the lowest and highest values, shape (entries,), of the vector."""
        low, high = (np.array([getattr(self.each[k], end) for k in self.unknown]) for end in ("low", "high"))
        return (low - self.middle) / self.scale, (high - self.middle) / self.scale

    @cached_property
    def precision(self) -> Array:
        """Return the inverse variance, shape (entries,), of the prior, in units of the vector."""
        prior = np.array([self.each[k].prior for k in self.unknown])
        return np.asarray((self.scale / prior) ** 2)

    def vector(self, start: Start) -> Array:
        """Return the vector (entries,) of given values, within the bounds."""
        given = dict(zip(self.simulation.names, self.simulation.values.tolist(), strict=True))
        known: Start = {**given, **start}
        recording = self.simulation.recording
        ids = [recording.logs.ids[i] for i in sorted(recording.runs)]
        values: list[float] = []
        for unknown in self.each:
            value = known[unknown.name]
            if isinstance(value, Mapping):
                values += [value[i] for i in ids]
            else:
                values += [value] * (len(ids) if unknown.own else 1)
        return np.clip((np.array(values) - self.middle) / self.scale, *self.bounds)

    def values(self, z: Array) -> Array:
        """Return the values (..., entries), SI, of vectors of the same shape."""
        return z * self.scale + self.middle

    def numbers(self, z: Array) -> Array:
        """Return the parameter sets (experiments, sets, numbers) of vectors (sets, entries)."""
        recording = self.simulation.recording
        values = np.tile(self.simulation.values, (len(recording.logs), len(z), 1))
        for k, unknown in enumerate(self.each):
            column = self.simulation.names.index(unknown.name)
            rows = np.sort(recording.runs) if unknown.own else slice(None)
            values[rows, :, column] = self.values(z)[:, self.unknown == k].T
        return values
