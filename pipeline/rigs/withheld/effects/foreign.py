"""Effects that belong to no family of the diagnosis."""

from dataclasses import dataclass, field

import numpy as np

from pipeline.rigs.withheld.effects.effect import ActuatorEffect, Make, Port, PortEffect, SensorEffect
from pipeline.rigs.withheld.effects.friction import stopping
from unmodelled.base.arrays import Array


@dataclass
class Centrifugal(PortEffect):
    """A force with the square of the speed and the sine of the position, as of a forgotten linkage."""

    strength: float  # amplitude per squared speed, SI unit of the port
    order: float  # wave number over the position
    phase: float  # rad

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        return dt * self.strength * np.sin(self.order * port.position + self.phase) * port.velocity**2


@dataclass
class HeatedFriction(PortEffect):
    """Dry friction proportional to a load, which falls to 30 % as its own heat accumulates."""

    load: Array  # (n,), friction force of the cold port
    capacity: float  # work over which the friction falls
    time: float  # time constant of the cooling, s
    _heat: Array | None = field(default=None, init=False, repr=False)

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        heat = np.zeros_like(port.velocity) if self._heat is None else self._heat
        most = dt * self.load * (0.3 + 0.7 * np.exp(-heat / self.capacity))
        taken = np.clip(stopping(port), -most, most)
        self._heat = heat * (1.0 - dt / self.time) + np.abs(taken * port.velocity)
        return taken


@dataclass
class FloorVibration(PortEffect):
    """A sinusoidal force of a shaking floor, with another phase in every run."""

    amplitude: float  # SI unit of the port
    frequency: float  # Hz
    phase: Array  # (n,), rad

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        return dt * self.amplitude * np.sin(2.0 * np.pi * self.frequency * t + self.phase)


def floor_vibration(typical: float, frequency: float) -> Make:
    """Draw the phases of a shaking floor."""
    return lambda a, plan, rng: FloorVibration(typical * a, frequency, rng.uniform(0.0, 6.28, plan.runs))


@dataclass
class HeatedMotor(ActuatorEffect):
    """A gain that falls with the heat of the command itself, as of weakening magnets."""

    loss: float  # relative loss per mean square of the command
    time: float  # time constant of the mean square, s
    _heat: Array | None = field(default=None, init=False, repr=False)

    def applied(self, dt: float, t: float, u: Array) -> Array:
        heat = np.zeros_like(u) if self._heat is None else self._heat
        self._heat = u**2 + (heat - u**2) * np.exp(-dt / self.time)
        return u / (1.0 + self.loss * self._heat)


@dataclass
class StickyValve(ActuatorEffect):
    """A sticking spool, which follows the command in one jump."""

    band: float  # distance of the command at which the spool jumps, in the unit of the command
    _held: Array | None = field(default=None, init=False, repr=False)

    def applied(self, dt: float, t: float, u: Array) -> Array:
        held = u if self._held is None else self._held
        self._held = np.asarray(np.where(np.abs(u - held) > self.band, u, held))
        return self._held


@dataclass
class MissedCounts(SensorEffect):
    """An encoder that misses counts at high speed."""

    share: float  # of the counts above the speed
    speed: float

    def seen(self, period: float, y: Array) -> Array:
        moved = np.diff(y, axis=0)
        lost = np.where(np.abs(moved) > self.speed * period, self.share * moved, 0.0)
        return np.asarray(y - np.concatenate([np.zeros_like(y[:1]), np.cumsum(lost, axis=0)]))
