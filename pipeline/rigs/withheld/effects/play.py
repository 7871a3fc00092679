"""Inertia that is attached to a port by play or by a spring: additional bodies with a motion of their own."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from pipeline.arrays import Array
from pipeline.rigs.withheld.effects.effect import Port, PortEffect


@dataclass
class LooseInertia(PortEffect):
    """Part of the machine's inertia with play, with impacts at its two stops."""

    name: str  # of the machine's constant that the inertia is part of
    inertia: float  # inertia of the loose part, SI unit
    play: float  # distance to each stop
    restitution: float  # coefficient of restitution at the stops
    quiet: float  # relative speed below which an impact has no rebound
    _body: tuple[Array, Array] | None = field(default=None, init=False, repr=False)

    def refitted(self, machine: Any) -> Any:
        return replace(machine, **{self.name: getattr(machine, self.name) - self.inertia})

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        position, velocity = (port.position, port.velocity) if self._body is None else self._body
        middle, relative = position + 0.5 * dt * velocity, velocity - port.velocity
        s = middle - port.position
        against = np.where(s >= self.play, relative > 0.0, (s <= -self.play) & (relative < 0.0))
        bounce = np.where(np.abs(relative) > self.quiet, self.restitution, 0.0)
        passed = np.where(against, (1.0 + bounce) * relative / (1.0 / self.inertia + port.mobility), 0.0)
        velocity = velocity - passed / self.inertia
        self._body = middle + 0.5 * dt * velocity, velocity
        return -passed


@dataclass
class Resonator(PortEffect):
    """Part of the machine's inertia on a spring."""

    name: str  # of the machine's constant that the inertia is part of
    inertia: float  # inertia of the part, SI unit
    frequency: float  # natural frequency with the port at rest, Hz
    damping: float  # damping ratio with the port at rest
    _body: tuple[Array, Array] | None = field(default=None, init=False, repr=False)

    def refitted(self, machine: Any) -> Any:
        return replace(machine, **{self.name: getattr(machine, self.name) - self.inertia})

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        position, velocity = (port.position, port.velocity) if self._body is None else self._body
        omega = 2.0 * np.pi * self.frequency
        middle, relative = position + 0.5 * dt * velocity, velocity - port.velocity
        s = middle - port.position
        passed = dt * self.inertia * (omega**2 * s + 2.0 * self.damping * omega * relative)
        velocity = velocity - passed / self.inertia
        self._body = middle + 0.5 * dt * velocity, velocity
        return -passed
