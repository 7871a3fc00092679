"""Forces by the position of a port, and inertia that is larger, loose or on a spring."""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from pipeline.rigs.withheld.effects.effect import Effect, Port, PortEffect
from unmodelled.base.arrays import Array


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
class RubberSpring(PortEffect):
    """A spring that is slightly softer at large deflections."""

    stiffness: float  # SI unit of the port
    rest: float  # position without force
    reach: float  # deflection beyond which the spring is softer

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        s = port.position - self.rest
        return dt * self.stiffness * s / np.sqrt(1.0 + 0.1 * (s / self.reach) ** 2)


@dataclass
class PlaySpring(PortEffect):
    """A spring with play, linear and cubic beyond the play."""

    stiffness: float  # linear stiffness, SI unit of the port
    hardening: float  # cubic stiffness, SI unit of the port
    rest: float  # centre of the play
    play: float  # half width of the play

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        s = port.position - self.rest
        beyond = s - np.clip(s, -self.play, self.play)
        return dt * (self.stiffness + self.hardening * beyond**2) * beyond


@dataclass
class OneSidedSpring(PortEffect):
    """A progressive spring that acts on one side only."""

    stiffness: float  # stiffness at the deflection `reach`, SI unit of the port
    begin: float  # position at which contact begins
    side: float  # side of the contact, 1 above `begin` and -1 below
    exponent: float = 1.7  # exponent of the force
    reach: float = 1.0  # deflection scale

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        depth = np.maximum(0.0, self.side * (port.position - self.begin)) / self.reach
        return dt * self.side * self.stiffness * self.reach * depth**self.exponent


@dataclass
class Bumper(PortEffect):
    """Stops with the law of Hunt and Crossley, stiffness depth^1.5 (1 + loss v), without pull."""

    stiffness: float  # SI unit of the port
    loss: float  # damping factor, inverse of a speed
    low: float  # position of the lower stop
    high: float  # position of the upper stop

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        above = np.maximum(0.0, port.position - self.high) ** 1.5
        below = np.maximum(0.0, self.low - port.position) ** 1.5
        push = above * np.maximum(0.0, 1.0 + self.loss * port.velocity)
        pull = below * np.maximum(0.0, 1.0 - self.loss * port.velocity)
        return dt * self.stiffness * (push - pull)


@dataclass
class WrongInertia(Effect):
    """An inertia that is larger than in the system file."""

    name: str  # of the machine's constant
    excess: float  # SI unit

    def refitted(self, machine: Any) -> Any:
        return replace(machine, **{self.name: getattr(machine, self.name) + self.excess})


@dataclass
class _AttachedBody(PortEffect):
    """Part of the machine's inertia that moves on its own; it starts with the motion of the port."""

    name: str  # of the machine's constant that the inertia is part of
    inertia: float  # inertia of the part, SI unit
    _body: tuple[Array, Array] | None = field(default=None, init=False, repr=False)

    @abstractmethod
    def _passed(self, dt: float, s: Array, relative: Array, port: Port) -> Array:
        """Return the impulse to the port, by distance and speed relative to the port, (n,) each."""

    def refitted(self, machine: Any) -> Any:
        return replace(machine, **{self.name: getattr(machine, self.name) - self.inertia})

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        position, velocity = (port.position, port.velocity) if self._body is None else self._body
        middle = position + 0.5 * dt * velocity
        passed = self._passed(dt, middle - port.position, velocity - port.velocity, port)
        velocity = velocity - passed / self.inertia
        self._body = middle + 0.5 * dt * velocity, velocity
        return -passed


@dataclass
class LooseInertia(_AttachedBody):
    """Part of the machine's inertia with play, with impacts at its two stops."""

    play: float  # distance to each stop
    restitution: float  # coefficient of restitution at the stops
    quiet: float  # relative speed below which an impact has no rebound

    def _passed(self, dt: float, s: Array, relative: Array, port: Port) -> Array:
        against = np.where(s >= self.play, relative > 0.0, (s <= -self.play) & (relative < 0.0))
        bounce = np.where(np.abs(relative) > self.quiet, self.restitution, 0.0)
        return np.where(against, (1.0 + bounce) * relative / (1.0 / self.inertia + port.mobility), 0.0)


@dataclass
class Resonator(_AttachedBody):
    """Part of the machine's inertia on a spring."""

    frequency: float  # natural frequency with the port at rest, Hz
    damping: float  # damping ratio with the port at rest

    def _passed(self, dt: float, s: Array, relative: Array, port: Port) -> Array:
        omega = 2.0 * np.pi * self.frequency
        return dt * self.inertia * (omega**2 * s + 2.0 * self.damping * omega * relative)
