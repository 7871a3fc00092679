"""The drive between the logged command and the input that acts."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from pipeline.arrays import Array
from pipeline.rigs.withheld.chain.part import Names, Part, VaryingPart
from pipeline.rigs.withheld.effects.actuators import Gain
from pipeline.rigs.withheld.effects.effect import ActuatorEffect
from pipeline.rigs.withheld.machine import Machine

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
    """The log holds the command; the drive follows it with a lag of first order, `time` s.

    Attributes:
        time: time constant of the lag, s.
    """

    time: float

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> DriveLag:
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
