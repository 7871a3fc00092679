"""Effects of an amplifier, a motor or a valve on the command."""

from collections import deque
from dataclasses import dataclass, field

import numpy as np

from pipeline.rigs.withheld.effects.effect import ActuatorEffect
from unmodelled.base.arrays import Array


@dataclass
class Gain(ActuatorEffect):
    """A gain error: the command is too strong by a share."""

    excess: float | Array  # share; one value per run is (n,)

    def applied(self, dt: float, t: float, u: Array) -> Array:
        return u * (1.0 + self.excess)


@dataclass
class Offset(ActuatorEffect):
    """An offset of the command."""

    offset: float  # unit of the command

    def applied(self, dt: float, t: float, u: Array) -> Array:
        return u + self.offset


@dataclass
class SoftSaturation(ActuatorEffect):
    """A saturation limit tanh(u / limit), as of saturating iron."""

    limit: float  # unit of the command

    def applied(self, dt: float, t: float, u: Array) -> Array:
        return self.limit * np.tanh(u / self.limit)


@dataclass
class RoundedDeadZone(ActuatorEffect):
    """A rounded dead zone u - width tanh(u / width)."""

    width: float  # half width, unit of the command

    def applied(self, dt: float, t: float, u: Array) -> Array:
        return u - self.width * np.tanh(u / self.width)


@dataclass
class UnequalSides(ActuatorEffect):
    """A gain that is higher for one sign of the command than for the other, with a gradual transition."""

    excess: float  # share at large positive commands, opposite at large negative commands
    width: float  # scale of the transition, unit of the command

    def applied(self, dt: float, t: float, u: Array) -> Array:
        return np.asarray(u * (1.0 + self.excess * np.tanh(u / self.width)))


@dataclass
class TwoPoleLag(ActuatorEffect):
    """A second-order lag with one pole at 1 / time and one five times as fast."""

    time: float  # larger time constant, s
    _state: tuple[Array, Array] | None = field(default=None, init=False, repr=False)

    def applied(self, dt: float, t: float, u: Array) -> Array:
        fast, slow = (u, u) if self._state is None else self._state
        fast = u + (fast - u) * np.exp(-5.0 * dt / self.time)
        slow = fast + (slow - fast) * np.exp(-dt / self.time)
        self._state = fast, slow
        return np.asarray(slow)


@dataclass
class SlowAmplifier(ActuatorEffect):
    """A limit of the rate of the output, which follows slower commands exactly."""

    rate: float  # unit of the command per second
    _last: Array | None = field(default=None, init=False, repr=False)

    def applied(self, dt: float, t: float, u: Array) -> Array:
        last = u if self._last is None else self._last
        self._last = np.asarray(last + np.clip(u - last, -dt * self.rate, dt * self.rate))
        return self._last


@dataclass
class Transport(ActuatorEffect):
    """A delay of the command; the first command acts before."""

    delay: float  # s
    _past: deque[Array] | None = field(default=None, init=False, repr=False)

    def applied(self, dt: float, t: float, u: Array) -> Array:
        steps = self.delay / dt
        whole = int(steps)
        if self._past is None:
            self._past = deque([u] * (whole + 2), maxlen=whole + 2)
        self._past.append(u)
        rest = steps - whole
        return (1.0 - rest) * self._past[1] + rest * self._past[0]
