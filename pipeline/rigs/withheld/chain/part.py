"""A part of the measurement chain, and the readings of the logger."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Self

import numpy as np

from pipeline.rigs.withheld.effects.changing import spread
from pipeline.rigs.withheld.effects.effect import ActuatorEffect, Effect
from pipeline.rigs.withheld.machine import Machine, Sensor
from unmodelled.base.arrays import Array

#: Variation from run to run: root mean square, share of the mean.
VARIATION = 0.05, 0.15
#: Families and channels that describe a part in the words of a diagnosis.
Names = tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Readings:
    """Signals of n runs."""

    t: Array  # (samples, n), time stamps, s
    u: Array  # (samples, n), logged
    outputs: Mapping[str, Array]  # (samples, n) each, by name, SI units


@dataclass(frozen=True)
class Part:
    """Does nothing, unless a subclass says so; its fields are its numbers in SI units."""

    def machine(self, machine: Machine) -> Machine:
        """Return the machine as it is built in this campaign."""
        return machine

    def effect(self, effect: Effect) -> Effect:
        """Return a planted effect as it is in this campaign."""
        return effect

    def drive(self) -> tuple[ActuatorEffect, ...]:
        """Return what happens to the command on its way to the machine; new objects, which may remember."""
        return ()

    def sensor(self, sensor: Sensor) -> Sensor:
        """Return a sensor as it is in this campaign."""
        return sensor

    def read(self, readings: Readings, rng: np.random.Generator) -> Readings:
        """Return the readings without noise and counts at the instants of the logger's clock."""
        return readings

    def processed(self, readings: Readings, machine: Machine, period: float) -> Readings:
        """Return the readings after a calculation, from those with noise and counts. Takes period in s."""
        return readings

    def names(self, machine: Machine, logged: tuple[str, ...]) -> Names:
        """Return families and channels that a diagnosis of the logged outputs may name for this part."""
        return ()

    @property
    def row(self) -> dict[str, Any]:
        """The part in truth.json."""
        numbers = {name: np.asarray(value).tolist() for name, value in asdict(self).items()}
        return {"part": type(self).__name__, "parameters": numbers}


@dataclass(frozen=True)
class VaryingPart(Part):
    """Part that is stronger than its mean by the share `excess`[i] in run i; the mean excess is zero."""

    excess: tuple[float, ...]  # (n,)

    @classmethod
    def drawn(cls, runs: int, rng: np.random.Generator) -> Self:
        """Draw the excess of every run."""
        return cls(tuple((float(rng.uniform(*VARIATION)) * spread(runs, rng)).tolist()))
