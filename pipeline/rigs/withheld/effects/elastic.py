"""Springs and stops."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.rigs.withheld.effects.effect import Array, Port, PortEffect


@dataclass
class RubberSpring(PortEffect):
    """`stiffness` times the distance from `rest`, a little softer beyond `reach`."""

    stiffness: float
    rest: float
    reach: float

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        s = port.position - self.rest
        return dt * self.stiffness * s / np.sqrt(1.0 + 0.1 * (s / self.reach) ** 2)


@dataclass
class PlaySpring(PortEffect):
    """No force within `play` of `rest`, beyond it a linear and a cubic one."""

    stiffness: float
    hardening: float
    rest: float
    play: float

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        s = port.position - self.rest
        beyond = s - np.clip(s, -self.play, self.play)
        return dt * (self.stiffness + self.hardening * beyond**2) * beyond


@dataclass
class OneSidedSpring(PortEffect):
    """Pushes back on one side only, from `begin` on (on the side of the sign of `side`), ever harder."""

    stiffness: float
    begin: float
    side: float
    exponent: float = 1.7
    reach: float = 1.0

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        depth = np.maximum(0.0, self.side * (port.position - self.begin)) / self.reach
        return dt * self.side * self.stiffness * self.reach * depth**self.exponent


@dataclass
class Bumper(PortEffect):
    """Stops at `low` and `high` after Hunt and Crossley: `stiffness` depth^1.5 (1 + `loss` v), no pull."""

    stiffness: float
    loss: float
    low: float
    high: float

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        above = np.maximum(0.0, port.position - self.high) ** 1.5
        below = np.maximum(0.0, self.low - port.position) ** 1.5
        push = above * np.maximum(0.0, 1.0 + self.loss * port.velocity)
        pull = below * np.maximum(0.0, 1.0 - self.loss * port.velocity)
        return dt * self.stiffness * (push - pull)
