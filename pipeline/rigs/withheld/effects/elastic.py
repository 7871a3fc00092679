"""Springs and stops."""

from dataclasses import dataclass

import numpy as np

from pipeline.arrays import Array
from pipeline.rigs.withheld.effects.effect import Port, PortEffect


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
