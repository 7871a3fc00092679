"""What an amplifier, a motor or a valve makes of its command."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import numpy as np

from pipeline.rigs.withheld.effects.effect import ActuatorEffect, Array


@dataclass
class Gain(ActuatorEffect):
    """Too strong by the share `excess`; (n,) if it differs between runs."""

    excess: float | Array

    def applied(self, dt: float, t: float, u: Array) -> Array:
        return u * (1.0 + self.excess)


@dataclass
class Offset(ActuatorEffect):
    """Too large by `offset`."""

    offset: float

    def applied(self, dt: float, t: float, u: Array) -> Array:
        return u + self.offset


@dataclass
class SoftSaturation(ActuatorEffect):
    """Iron that saturates: `limit` tanh(u/`limit`)."""

    limit: float

    def applied(self, dt: float, t: float, u: Array) -> Array:
        return self.limit * np.tanh(u / self.limit)


@dataclass
class RoundedDeadZone(ActuatorEffect):
    """Nothing happens around zero, and about `width` is missing further out: u - `width` tanh(u/`width`)."""

    width: float

    def applied(self, dt: float, t: float, u: Array) -> Array:
        return u - self.width * np.tanh(u / self.width)


@dataclass
class TwoPoleLag(ActuatorEffect):
    """A lag of second order: a pole at 1/`time` and one five times as fast."""

    time: float
    _state: tuple[Array, Array] | None = field(default=None, init=False, repr=False)

    def applied(self, dt: float, t: float, u: Array) -> Array:
        fast, slow = (u, u) if self._state is None else self._state
        fast = u + (fast - u) * np.exp(-5.0 * dt / self.time)
        slow = fast + (slow - fast) * np.exp(-dt / self.time)
        self._state = fast, slow
        return np.asarray(slow)


@dataclass
class Transport(ActuatorEffect):
    """The command acts `delay` seconds late; the start value acts before."""

    delay: float
    _past: deque[Array] | None = field(default=None, init=False, repr=False)

    def applied(self, dt: float, t: float, u: Array) -> Array:
        steps = self.delay / dt
        whole = int(steps)
        if self._past is None:
            self._past = deque([u] * (whole + 2), maxlen=whole + 2)
        self._past.append(u)
        rest = steps - whole
        return (1.0 - rest) * self._past[1] + rest * self._past[0]
