"""Magnitudes of all quantities in the logs, from which starting values and smoothing are chosen."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
import sympy as sp

from unmodelled.base.arrays import Array, Indices
from unmodelled.effects.load import load
from unmodelled.effects.motion import mobility
from unmodelled.systems.model import System
from unmodelled.systems.numeric import numpy_system_function

#: Samples over which a measured slope is taken; one is too noisy.
LAG = 10
#: Samples that tell these scales well enough.
ENOUGH = 20_000
#: Of all the effort that moves a port: what it lacks is taken to be at least this.
LEAST = 1e-3
_TINY = 1e-12


@dataclass(frozen=True)
class Spread:
    """Range and root mean square of a quantity, in SI units; the root mean square is positive."""

    low: float
    high: float
    rms: float

    @classmethod
    def of(cls, values: Array) -> Spread:
        """Compute the range and root mean square of an array of any shape (...)."""
        finite = values[np.isfinite(values)]
        if not len(finite):
            return cls(0.0, 0.0, _TINY)
        return cls(float(finite.min()), float(finite.max()), max(float(np.sqrt(np.mean(finite**2))), _TINY))

    @property
    def middle(self) -> float:
        """Mean of the smallest and the largest value."""
        return 0.5 * (self.low + self.high)

    @property
    def half(self) -> float:
        """Half the difference between the largest and the smallest value, positive."""
        return max(0.5 * (self.high - self.low), _TINY)

    @property
    def largest(self) -> float:
        """Largest magnitude, not less than the root mean square."""
        return max(abs(self.low), abs(self.high), self.rms)


@dataclass(frozen=True)
class Load:
    """Load of a port of the known physics, see `load`."""

    text: str  # in names of the system file
    expression: sp.Expr  # in the unit of the effort
    spread: Spread


@dataclass(frozen=True)
class Scales:
    """Magnitudes of the quantities of a system in the logs, in SI units."""

    of: Mapping[str, Spread]  # of each state, input, signal, constant and parameter
    outputs: Mapping[str, Spread]
    effort: Mapping[str, float]  # root mean square that the known physics lacks, by port
    mobility: Mapping[str, float]  # largest acceleration per effort, by port
    period: float  # sampling period, s
    duration: float  # of the longest experiment, s
    loads: Mapping[str, Load] = field(default_factory=dict)  # of the ports that have one
    moving: Mapping[str, float] = field(default_factory=dict)  # root mean square of all effort, by port

    @classmethod
    def measured(
        cls, system: System, period: float, offsets: Indices, t: Array, x: Array, u: Array, c: Array
    ) -> Scales:
        """Compute the magnitudes from n experiments on one clock, whose first rows are `offsets` (n + 1,).

        Takes t (M,), x (M, states), u (M, inputs), c (n, constants).
        """
        samples = _Samples(system, period, offsets, t, x, u, c)
        names = [*(s.name for s in system.states), *(i.name for i in system.inputs)]
        columns = np.concatenate([x, u], axis=1).T
        signals = samples.values(system.signals.values())
        outputs = samples.values(o.expression for o in system.outputs)
        sizes = {name: Spread.of(column) for name, column in zip(names, columns, strict=True)}
        sizes |= {name: Spread.of(column) for name, column in zip(system.signals, signals, strict=True)}
        sizes |= {k.name: Spread.of(column) for k, column in zip(system.operating_point, c.T, strict=True)}
        sizes |= {p.name: Spread.of(np.array([p.value])) for p in system.parameters}
        carried = {p.name: found for p in system.ports if (found := load(system, p)) is not None}
        loads = samples.values(expression for _, expression in carried.values())
        efforts = samples.efforts()
        return cls(
            of=sizes,
            outputs={o.name: Spread.of(y) for o, y in zip(system.outputs, outputs, strict=True)},
            effort={name: lacking for name, (lacking, _) in efforts.items()},
            mobility=samples.mobilities(),
            period=period,
            duration=period * float(np.diff(offsets).max() - 1),
            loads={
                name: Load(*found, Spread.of(row))
                for (name, found), row in zip(carried.items(), loads, strict=True)
            },
            moving={name: moving for name, (_, moving) in efforts.items()},
        )


@dataclass(frozen=True)
class _Samples:
    system: System
    period: float
    offsets: Indices
    t: Array
    x: Array
    u: Array
    c: Array

    def values(self, expressions: Iterable[sp.Expr], rows: Indices | None = None) -> Array:
        """Return the values (k, samples) of expressions at some of the samples, with all efforts zero."""
        some = self._some() if rows is None else rows
        owner = np.searchsorted(self.offsets, some, "right") - 1
        function = numpy_system_function(self.system, list(expressions), efforts_zero=True)
        known = np.array(self.system.values)
        return function(self.t[some], self.x[some], self.u[some], np.empty(0), known, self.c[owner]).T

    def _some(self) -> Indices:
        return np.arange(0, len(self.t), -(-len(self.t) // ENOUGH))

    def mobilities(self) -> dict[str, float]:
        ports = self.system.ports
        found = self.values([mobility(self.system, port) for port in ports])
        return {
            p.name: float(np.max(np.abs(row[np.isfinite(row)]), initial=0.0))
            for p, row in zip(ports, found, strict=True)
        }

    def efforts(self) -> dict[str, tuple[float, float]]:
        """Return the missing effort of each port, by least squares of measured slopes minus known physics,
        and all effort that moves the port.

        States are weighted by their slopes, so that units do not matter; samples at which a port has little
        influence have little weight.
        """
        system, states = self.system, len(self.system.states)
        lag = int(min(LAG, np.diff(self.offsets).min() - 1))
        first = np.concatenate(
            [np.arange(a, b - lag) for a, b in zip(self.offsets[:-1], self.offsets[1:], strict=True)]
        )
        first = first[:: -(-len(first) // ENOUGH)]
        slope = ((self.x[first + lag] - self.x[first]) / (lag * self.period)).T
        known = np.mean([self.values(system.closed, first + k) for k in (0, lag // 2, lag)], axis=0)
        slopes = [sp.diff(f, e) for e in system.e for f in system.closed]
        influence = self.values(slopes, first + lag // 2).reshape(-1, states, len(first))
        weight = 1.0 / np.array([Spread.of(row).rms for row in slope])[:, None] ** 2
        found = {}
        for port, b in zip(system.ports, influence, strict=True):
            power = Spread.of(np.sum(weight * b**2, axis=0)).rms
            lacking, moving = (
                Spread.of(np.sum(weight * b * r, axis=0)).rms / power for r in (slope - known, slope)
            )
            found[port.name] = max(lacking, LEAST * moving, _TINY), max(moving, _TINY)
        return found
