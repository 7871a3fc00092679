"""Effects that belong to no family of the diagnosis."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from pipeline.rigs.withheld.effects.effect import ActuatorEffect, Array, Port, PortEffect, SensorEffect
from pipeline.rigs.withheld.effects.friction import stopping


@dataclass
class Centrifugal(PortEffect):
    """A force with the square of the speed that turns round with the position, as of a forgotten linkage:
    `strength` sin(`order` q + `phase`) v^2.
    """

    strength: float
    order: float
    phase: float

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        return dt * self.strength * np.sin(self.order * port.position + self.phase) * port.velocity**2


@dataclass
class HeatedFriction(PortEffect):
    """Dry friction in proportion to `load` (n,) that fades as its own heat builds up: to 30 %, over the work
    `capacity`; it cools with the time constant `time`.
    """

    load: Array
    capacity: float
    time: float
    _heat: Array | None = field(default=None, init=False, repr=False)

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        heat = np.zeros_like(port.velocity) if self._heat is None else self._heat
        most = dt * self.load * (0.3 + 0.7 * np.exp(-heat / self.capacity))
        taken = np.clip(stopping(port), -most, most)
        self._heat = heat * (1.0 - dt / self.time) + np.abs(taken * port.velocity)
        return taken


@dataclass
class FloorVibration(PortEffect):
    """The floor shakes: `amplitude` at `frequency` (Hz), with another `phase` (n,) in every run."""

    amplitude: float
    frequency: float
    phase: Array

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        return dt * self.amplitude * np.sin(2.0 * np.pi * self.frequency * t + self.phase)


@dataclass
class HeatedMotor(ActuatorEffect):
    """The magnets weaken with the heat that the command itself makes: by `loss` per unit of its mean square
    over the time constant `time`.
    """

    loss: float
    time: float
    _heat: Array | None = field(default=None, init=False, repr=False)

    def applied(self, dt: float, t: float, u: Array) -> Array:
        heat = np.zeros_like(u) if self._heat is None else self._heat
        self._heat = u**2 + (heat - u**2) * np.exp(-dt / self.time)
        return u / (1.0 + self.loss * self._heat)


@dataclass
class StickyValve(ActuatorEffect):
    """A spool that sticks: it follows, in one jump, only once the command is `band` away."""

    band: float
    _held: Array | None = field(default=None, init=False, repr=False)

    def applied(self, dt: float, t: float, u: Array) -> Array:
        held = u if self._held is None else self._held
        self._held = np.asarray(np.where(np.abs(u - held) > self.band, u, held))
        return self._held


@dataclass
class SlowAmplifier(ActuatorEffect):
    """Its output changes by no more than `rate` per second."""

    rate: float
    _last: Array | None = field(default=None, init=False, repr=False)

    def applied(self, dt: float, t: float, u: Array) -> Array:
        last = u if self._last is None else self._last
        self._last = np.asarray(last + np.clip(u - last, -dt * self.rate, dt * self.rate))
        return self._last


@dataclass
class MissedCounts(SensorEffect):
    """An encoder that misses the share `share` of its counts above the speed `speed`."""

    share: float
    speed: float

    def seen(self, period: float, y: Array) -> Array:
        moved = np.diff(y, axis=0)
        lost = np.where(np.abs(moved) > self.speed * period, self.share * moved, 0.0)
        return np.asarray(y - np.concatenate([np.zeros_like(y[:1]), np.cumsum(lost, axis=0)]))
