"""Loads and inertia that the known physics leaves out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pipeline.arrays import Array
from pipeline.rigs.withheld.effects.effect import Effect, Port, PortEffect


@dataclass
class ConstantLoad(PortEffect):
    """A constant load.

    Attributes:
        load: force, SI unit of the port; one value per run has shape (n,).
    """

    load: float | Array

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        return np.broadcast_to(dt * self.load, port.velocity.shape)


@dataclass
class Unbalance(PortEffect):
    """An eccentric weight on a shaft: moment sin(angle - phase).

    Attributes:
        moment: largest torque, N m.
        phase: angle without torque, rad.
    """

    moment: float
    phase: float

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        return dt * self.moment * np.sin(port.position - self.phase)


@dataclass
class Ripple(PortEffect):
    """Harmonics of the position.

    Attributes:
        amplitudes: amplitude of every harmonic, SI unit of the port.
        orders: wave number of every harmonic, 1/m or 1/rad.
        phases: phase of every harmonic, rad.
    """

    amplitudes: Sequence[float]
    orders: Sequence[float]
    phases: Sequence[float]

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        total = np.zeros_like(port.position)
        for amplitude, order, phase in zip(self.amplitudes, self.orders, self.phases, strict=True):
            total += amplitude * np.sin(order * port.position + phase)
        return dt * total


@dataclass
class WrongInertia(Effect):
    """An inertia that is larger than in the system file.

    Attributes:
        name: name of the machine's constant.
        excess: difference of the inertia, SI unit.
    """

    name: str
    excess: float

    def refitted(self, machine: Any) -> Any:
        return replace(machine, **{self.name: getattr(machine, self.name) + self.excess})
