"""The gate of the start of a run: rates and outputs have values there, and what stores is positive."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import sympy as sp

from unmodelled.base.arrays import Array, Mask
from unmodelled.diagnosis.data.remark import listed, quantity
from unmodelled.effects.motion import mobility
from unmodelled.engine.fmu.stepper import defaults
from unmodelled.engine.machine.program import Program
from unmodelled.systems.model import System, symbol
from unmodelled.systems.units import parse_unit

#: Random values of what a user sets (inputs, and constants without a value), and their decades in SI.
DRAWS, DECADES = 256, (-6.0, 9.0)
#: Factors of a number, and values instead of zero, with which a fault that the number causes may be gone.
FACTORS, INSTEAD = (-1.0, 0.1, 10.0), (1.0, -1.0)
#: Units of what stores (of a tank its area or volume), which is positive.
_STORING = {
    parse_unit(unit).dimension for unit in ("kg", "kg m^2", "m^2", "m^3", "F", "H", "J/K", "J/(kg K)")
}


def impossible_start(system: System) -> str:
    """Return why a system cannot start as it is, with the number to blame; empty if it can.

    Initial states, rates and outputs have values for some inputs, no input acts before it is given, and every
    mass, moment of inertia or other store is positive, also one that is a difference of numbers. A number in
    the unit of a store that is only a part of one, such as a product of inertia, may be negative.
    """
    start = _Start(system)
    return next((fault for faults in start.faults() for fault in faults), "")


@dataclass(frozen=True)
class _Start:
    """Values of a system at the start of a run, for several inputs and constants that a user may set."""

    system: System

    @cached_property
    def needed(self) -> dict[str, sp.Expr]:
        """Expressions that need a value, by their names in words."""
        system, states = self.system, self.system.states
        return {
            **{f"the start of {s.name}": x for s, x in zip(states, system.x, strict=True)},
            **{f"the rate of {s.name}": rate for s, rate in zip(states, system.closed, strict=True)},
            **{f"the output {y.name}": y.expression for y in system.outputs},
        }

    @cached_property
    def initial(self) -> tuple[sp.Expr, ...]:
        """Initial states as expressions of inputs, parameters and constants."""
        starts = {symbol(s.name): s.initial for s in self.system.states}
        found = tuple(starts.values())
        for _ in found:  # an initial value that depends on others, which depend on others
            found = tuple(value.xreplace(starts) for value in found)
        return found

    @cached_property
    def drawn(self) -> tuple[Array, Array]:
        """Inputs (draws, inputs) and constants (draws, constants), SI; those of a new FMU first."""
        free = [c.other is None for c in self.system.operating_point]
        rng, shape = np.random.default_rng(0), (DRAWS, len(self.system.inputs) + len(free))
        values = 10.0 ** rng.uniform(*DECADES, shape) * rng.choice([-1.0, 1.0], shape)
        values[0] = 0.0
        u, c = np.split(values, [len(self.system.inputs)], axis=1)
        return u, np.where(free, c, defaults(self.system))

    @cached_property
    def programs(self) -> tuple[Program, Program]:
        """Programs of the initial states and of the needed expressions."""
        system = self.system
        return Program.of_values(system, self.initial), Program.of_values(system, [*self.needed.values()])

    def values(self, program: Program, p: Array, starts: Mapping[int, float]) -> Array:
        """Return values (draws, expressions) with parameters p and other starts by number of the state."""
        (u, c), none = self.drawn, np.zeros((DRAWS, len(self.system.states)))
        x = self.programs[0].evaluate(np.array(0.0), none, u, p, c)
        for k, value in starts.items():
            x[:, k] = value
        return program.evaluate(np.array(0.0), x, u, p, c)

    def known(self, changed: Mapping[str, float], starts: Mapping[int, float]) -> Mask:
        """Return which needed expressions have a value, with other parameters and other starts."""
        p = np.array(self.system.with_values(changed).values)
        return np.asarray(np.isfinite(self.values(self.programs[1], p, starts)).any(axis=0))

    def missing(self) -> Iterator[str]:
        """Yield what has no value, with the numbers of which each alone may be to blame."""
        names = list(self.needed)
        for k in np.flatnonzero(~self.known({}, {})).tolist():
            blamed = [number for number, p, x in self._numbers() if self.known(p, x)[k]]
            told = f" with {listed(dict.fromkeys(blamed))}" if blamed else ""
            yield f"{names[k]} has no value at the start{told}: correct the system file"

    def _numbers(self) -> Iterator[tuple[str, Mapping[str, float], Mapping[int, float]]]:
        """Parameters and starts in words, each with other values that it may have."""
        for p in self.system.parameters:
            for other in _others(p.value):
                yield f"{p.name} = {quantity(p.value, p.unit)}", {p.name: other}, {}
        for k, s in enumerate(self.system.states):
            if s.initial.is_Number:
                for other in _others(float(s.initial)):
                    yield f"the start {s.name} = {quantity(float(s.initial), s.unit)}", {}, {k: other}

    def faults(self) -> Sequence[Iterator[str]]:
        """Return the faults of every kind, the clearest first."""
        return self.missing(), self.early(), self.negative(), self.turned()

    def early(self) -> Iterator[str]:
        """Yield inputs that act before they are given, which only a log can tell."""
        for item in self.system.inputs:
            if item.delay < 0.0:
                yield (
                    f"{item.name} acts {quantity(-item.delay, 's')} before it is given: write a delay of 0 "
                    "or more into the system file"
                )

    def turned(self) -> Iterator[str]:
        """Yield ports that a load moves the wrong way at all inputs and constants."""
        ports = [replace(p, velocity=p.velocity or p.position) for p in self.system.ports]
        program = Program.of_values(self.system, [mobility(self.system, port) for port in ports])
        moved = self.values(program, np.array(self.system.values), {})
        for port, each in zip(ports, moved.T, strict=True):
            if (each > 0.0).all():
                what = "mass or inertia" if port.domain == "power" else "capacity"
                yield f"the {what} at {port.name} is negative at the start: correct the system file"

    def negative(self) -> Iterator[str]:
        """Yield stores that are negative: with their signs, a divisor of a rate changes its sign."""
        stores = (p for p in self.system.parameters if parse_unit(p.unit).dimension in _STORING)
        below = {p.name: p for p in stores if p.value < 0.0}
        powers = {power for rate in self.system.closed for power in rate.atoms(sp.Pow)}
        divisors = [power.base for power in powers if power.exp.could_extract_minus_sign()]
        program = Program.of_values(self.system, divisors)
        given = self.values(program, np.array(self.system.values), {})
        for name, p in below.items():
            changed = self.system.with_values({name: -p.value})
            if (given * self.values(program, np.array(changed.values), {}) < 0.0).any():
                told = f"{name} = {quantity(p.value, p.unit)}"
                yield f"{told}, and what stores is positive: correct the system file"


def _others(value: float) -> tuple[float, ...]:
    return tuple(value * factor for factor in FACTORS) if value else INSTEAD
