"""What every virtual machine has: motion, ports, a drive, sensors and a list of what can be planted."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.rigs.withheld.effects.effect import Plantable, Port

Array = NDArray[np.float64]
Conditions = Mapping[str, Array]


class Sensor(NamedTuple):
    """An output: coordinate `row` or its rate, in steps of `quantum` (0: none) with `noise` (rms)."""

    output: str
    row: int
    rate: bool
    quantum: float
    noise: float
    wraps: bool = False


@dataclass(frozen=True)
class Range:
    """Of the references or commands: `amplitude` about `centre`, up to `band` (Hz)."""

    amplitude: float
    band: float
    centre: float = 0.0


class Machine(ABC):
    """n runs of a machine side by side: positions q and velocities v are (d, n), SI units.

    Class attributes: `name` of the system file; `input`; `periods` of the logger, s, and numbers of `runs` to
    choose from; `duration` of a run, s; `range` of the references; `sensors`, those of `optional` are not
    always logged; `factors` with their levels; `groups`; `friction`: ports by name of their known damping;
    `doubtful`: constants that a user may know badly, each with the families that a wrong value resembles;
    what is `plantable`.
    """

    name: ClassVar[str]
    input: ClassVar[str]
    periods: ClassVar[tuple[float, ...]]
    duration: ClassVar[float]
    runs: ClassVar[tuple[int, ...]]
    range: ClassVar[Range]
    sensors: ClassVar[tuple[Sensor, ...]]
    optional: ClassVar[tuple[str, ...]] = ()
    factors: ClassVar[Mapping[str, tuple[float, ...]]] = {}
    groups: ClassVar[tuple[str, ...]] = ()
    friction: ClassVar[Mapping[str, str]]
    doubtful: ClassVar[Mapping[str, tuple[str, ...]]]
    plantable: ClassVar[tuple[Plantable, ...]]

    @abstractmethod
    def start(self, runs: int, rng: np.random.Generator) -> Array:
        """Return the positions (d, n) in which the machine rests before a run."""

    @abstractmethod
    def command(self, reference: Array, slope: Array, q: Array, v: Array, c: Conditions) -> Array:
        """Return the controller's command to the drive, (n,), at a reference (n,) of slope `slope` (n,)."""

    def regulated(self, reference: Array, slope: Array, q: Array, v: Array, c: Conditions) -> Array:
        """Return the command of a controller with feedback; `reference` is its set point."""
        return self.command(reference, slope, q, v, c)

    @abstractmethod
    def acceleration(self, q: Array, v: Array, u: Array, c: Conditions) -> Array:
        """Return the accelerations (d, n) without any planted force."""

    @abstractmethod
    def port(self, name: str, q: Array, v: Array, c: Conditions) -> Port:
        """Return the port `name` in a state of the machine."""
