"""Friction and drag as set-valued laws, by Moreau's projection: a force that stops the port, if it can."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass, field

import numpy as np

from pipeline.rigs.withheld.effects.effect import Array, Port, PortEffect

_RIGID = 1e-12  # mobility below which a port cannot be moved, 1/kg or 1/(kg m^2)


def stopping(port: Port) -> Array:
    """Return the impulse (n,) that would bring the port to rest."""
    return port.velocity / np.maximum(port.mobility, _RIGID)


class DryFriction(PortEffect):
    """Sticks as long as the limit suffices, and slides against it otherwise."""

    @abstractmethod
    def limit(self, port: Port) -> Array:
        """Return the largest friction force (n,)."""

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        most = dt * self.limit(port)
        return np.clip(stopping(port), -most, most)


@dataclass
class Coulomb(DryFriction):
    """One limit, `force`, whether at rest or sliding; (n,) if it differs between runs."""

    force: float | Array

    def limit(self, port: Port) -> Array:
        return np.broadcast_to(self.force, port.velocity.shape)


@dataclass
class ArctanFriction(PortEffect):
    """2/pi `force` atan(v/`creep`): it never quite sticks."""

    force: float
    creep: float

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        sliding = dt * self.force * 2.0 / np.pi * np.arctan(port.velocity / self.creep)
        most = np.abs(stopping(port))  # so that a long step cannot turn the motion round
        return np.clip(sliding, -most, most)


@dataclass
class LorentzFriction(DryFriction):
    """Falls from `static` to `kinetic` as a Lorentz curve with half width `speed`."""

    kinetic: float
    static: float
    speed: float

    def limit(self, port: Port) -> Array:
        return self.kinetic + (self.static - self.kinetic) / (1.0 + (port.velocity / self.speed) ** 2)


@dataclass
class TustinFriction(DryFriction):
    """Falls from `static` to `kinetic` exponentially over `speed`."""

    kinetic: float
    static: float
    speed: float

    def limit(self, port: Port) -> Array:
        return self.kinetic + (self.static - self.kinetic) * np.exp(-np.abs(port.velocity) / self.speed)


@dataclass
class TightSpot(DryFriction):
    """Dry friction within about `width` of the position `centre`, at most `force`."""

    force: float
    centre: float
    width: float

    def limit(self, port: Port) -> Array:
        return self.force * np.exp(-(((port.position - self.centre) / self.width) ** 2))


@dataclass
class RubbingArc(DryFriction):
    """Dry friction over one half of every turn, largest (`force`) at the angle `phase`."""

    force: float
    phase: float

    def limit(self, port: Port) -> Array:
        return self.force * np.maximum(0.0, np.cos(port.position - self.phase))


@dataclass
class MaxwellSlip(PortEffect):
    """Presliding as parallel springs that slip one after the other; `force` when all of them do.

    The springs have equal stiffness and slip at deflections that grow up to `travel` (Iwan's model).
    """

    force: float
    travel: float
    count: int = 6
    _spring: Array | None = field(default=None, init=False, repr=False)

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        slips = self.travel * np.arange(1, self.count + 1)[:, None] / self.count
        before = np.zeros((self.count, len(port.velocity))) if self._spring is None else self._spring
        self._spring = np.clip(before + dt * port.velocity, -slips, slips)
        return np.asarray(dt * self.force / float(slips.sum()) * self._spring.sum(axis=0))


@dataclass
class EyringDrag(PortEffect):
    """A lubricant that thins a little under shear: `damping` v at low speed, less far above `speed`."""

    damping: float
    speed: float

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        return dt * self.damping * self.speed * np.arcsinh(port.velocity / self.speed)


@dataclass
class Windage(PortEffect):
    """`drag` v |v| at high speed, laminar below `speed`."""

    drag: float
    speed: float

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        return dt * self.drag * port.velocity * np.hypot(port.velocity, self.speed)
