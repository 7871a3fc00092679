"""Parts of the chain before the machine: controller, drive, and friction that varies from run to run."""

from dataclasses import dataclass, field, replace
from typing import Any, Self

import numpy as np

from pipeline.rigs.withheld.chain.part import Names, Part, VaryingPart
from pipeline.rigs.withheld.effects.actuators import Gain
from pipeline.rigs.withheld.effects.effect import ActuatorEffect, Effect, Port
from pipeline.rigs.withheld.effects.friction import DryFriction
from pipeline.rigs.withheld.machine import Conditions, Machine
from unmodelled.base.arrays import Array

LAG = 0.001, 0.005  # s


@dataclass
class _FirstOrder(ActuatorEffect):
    time: float
    _state: Array | None = field(default=None, init=False, repr=False)

    def applied(self, dt: float, t: float, u: Array) -> Array:
        last = u if self._state is None else self._state
        self._state = u + (last - u) * np.exp(-dt / self.time)
        return self._state


@dataclass(frozen=True)
class DriveLag(Part):
    """Drive that follows the logged command with a lag of first order."""

    time: float  # s

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> Self:
        """Draw a drive."""
        return cls(float(rng.uniform(*LAG)))

    def drive(self) -> tuple[ActuatorEffect, ...]:
        return (_FirstOrder(self.time),)

    def names(self, machine: Machine, logged: tuple[str, ...]) -> Names:
        return tuple((family, f"actuator:{machine.input}") for family in ("actuator_lag", "input_delay"))


@dataclass(frozen=True)
class VaryingSupply(VaryingPart):
    """The drive is stronger by the share `excess`[i] in run i, with mean zero."""

    def drive(self) -> tuple[ActuatorEffect, ...]:
        return (Gain(np.array(self.excess)),)

    def names(self, machine: Machine, logged: tuple[str, ...]) -> Names:
        return (("scatter", f"actuator:{machine.input}"),)


FILTER = 0.003, 0.008  # s


@dataclass(frozen=True)
class ClosedLoop(Part):
    """Controller of the input, from a set point and encoder positions.

    The speed is the difference of two positions after a low-pass of first order: counts reach the input.
    """

    filter: float  # time constant of the low-pass, s

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> Self:
        """Draw the filter of the speed."""
        return cls(float(rng.uniform(*FILTER)))


class Controller:
    """Calls `machine.regulated` once per sample of `period` s; it remembers one simulation."""

    def __init__(self, machine: Machine, loop: ClosedLoop, period: float) -> None:
        self.machine, self.period = machine, period
        self.keep = np.exp(-period / loop.filter)
        counts = {s.row: s.quantum for s in machine.sensors if not s.rate}
        self.counts = np.array([counts[row] for row in sorted(counts)])[:, None]
        self.last: tuple[Array, Array] | None = None

    def __call__(self, reference: Array, slope: Array, q: Array, v: Array, c: Conditions) -> Array:
        """Return the command (n,) at true positions and velocities (d, n)."""
        shown = self.counts * np.round(q / self.counts)
        before, speed = (shown, np.zeros_like(shown)) if self.last is None else self.last
        speed = self.keep * speed + (1.0 - self.keep) * (shown - before) / self.period
        self.last = shown, speed
        return self.machine.regulated(reference, slope, shown, speed, c)


@dataclass
class _Varied(DryFriction):
    """Dry friction times `factor` (n,)."""

    inner: DryFriction
    factor: Array

    def limit(self, port: Port) -> Array:
        return self.factor * self.inner.limit(port)

    @property
    def parameters(self) -> dict[str, Any]:
        """Those of the mean friction."""
        return self.inner.parameters


@dataclass(frozen=True)
class VaryingFriction(VaryingPart):
    """Known damping, and planted dry friction, are larger by the share `excess`[i] in run i, mean zero."""

    @property
    def _factor(self) -> Array:
        return 1.0 + np.array(self.excess)

    def machine(self, machine: Machine) -> Machine:
        damping = {name: getattr(machine, name) * self._factor for name in machine.friction}
        varied: Machine = replace(machine, **damping)  # type: ignore[type-var]
        return varied

    def effect(self, effect: Effect) -> Effect:
        return _Varied(effect, self._factor) if isinstance(effect, DryFriction) else effect

    def names(self, machine: Machine, logged: tuple[str, ...]) -> Names:
        return tuple(("scatter", port) for port in sorted(set(machine.friction.values())))
