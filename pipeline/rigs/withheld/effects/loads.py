"""Loads and inertia that the known physics leaves out."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pipeline.arrays import Array
from pipeline.rigs.withheld.effects.effect import Effect, Port, PortEffect


@dataclass
class ConstantLoad(PortEffect):
    """A constant load."""

    load: float | Array  # SI unit of the port; one value per run is (n,)

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        return np.broadcast_to(dt * self.load, port.velocity.shape)


@dataclass
class Unbalance(PortEffect):
    """An eccentric weight on a shaft: moment sin(angle - phase)."""

    moment: float  # largest torque, N m
    phase: float  # angle without torque, rad

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        return dt * self.moment * np.sin(port.position - self.phase)


@dataclass
class Ripple(PortEffect):
    """Harmonics of the position."""

    amplitudes: Sequence[float]  # SI unit of the port
    orders: Sequence[float]  # wave numbers, 1/m or 1/rad
    phases: Sequence[float]  # rad

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        total = np.zeros_like(port.position)
        for amplitude, order, phase in zip(self.amplitudes, self.orders, self.phases, strict=True):
            total += amplitude * np.sin(order * port.position + phase)
        return dt * total


@dataclass
class WrongInertia(Effect):
    """An inertia that is larger than in the system file."""

    name: str  # of the machine's constant
    excess: float  # SI unit

    def refitted(self, machine: Any) -> Any:
        return replace(machine, **{self.name: getattr(machine, self.name) + self.excess})
