"""Loads and inertia that the known physics does not have."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pipeline.rigs.withheld.effects.effect import Array, Effect, Port, PortEffect


@dataclass
class ConstantLoad(PortEffect):
    """`load`, the same everywhere; (n,) if it differs between runs."""

    load: float | Array

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        return np.broadcast_to(dt * self.load, port.velocity.shape)


@dataclass
class Unbalance(PortEffect):
    """An eccentric weight on a shaft: `moment` sin(angle - `phase`)."""

    moment: float
    phase: float

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        return dt * self.moment * np.sin(port.position - self.phase)


@dataclass
class Ripple(PortEffect):
    """Harmonics of the position: `amplitudes` at the wave numbers `orders` (1/m or 1/rad) with `phases`."""

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
    """The inertia `name` of the machine is larger by `excess` than the drawing says."""

    name: str
    excess: float

    def refitted(self, machine: Any) -> Any:
        return replace(machine, **{self.name: getattr(machine, self.name) + self.excess})
