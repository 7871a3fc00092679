"""Friction and drag as set-valued laws, by Moreau's projection: friction stops the port within its limit."""

from abc import abstractmethod
from dataclasses import dataclass, field

import numpy as np

from pipeline.rigs.withheld.effects.effect import Port, PortEffect
from unmodelled.base.arrays import Array

_RIGID = 1e-12  # mobility below which a port cannot be moved, 1/kg or 1/(kg m^2)


def stopping(port: Port) -> Array:
    """Return the impulse that brings the port to rest; gives (n,)."""
    return port.velocity / np.maximum(port.mobility, _RIGID)


class DryFriction(PortEffect):
    """Friction that sticks within its limit, and slides at its limit otherwise."""

    @abstractmethod
    def limit(self, port: Port) -> Array:
        """Return the largest friction force.

        Args:
            port: state of the port in n runs.

        Returns:
            Force, SI unit of the port, shape (n,).
        """

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        most = dt * self.limit(port)
        return np.clip(stopping(port), -most, most)


@dataclass
class Coulomb(DryFriction):
    """The same limit at rest and when sliding."""

    force: float | Array  # SI unit of the port; one value per run is (n,)

    def limit(self, port: Port) -> Array:
        return np.broadcast_to(self.force, port.velocity.shape)


@dataclass
class ArctanFriction(PortEffect):
    """A smooth friction force 2 / pi * force * atan(v / creep), without sticking."""

    force: float  # friction force at high speed, SI unit of the port
    creep: float  # speed scale of the transition

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        sliding = dt * self.force * 2.0 / np.pi * np.arctan(port.velocity / self.creep)
        most = np.abs(stopping(port))  # so that a long step cannot turn the motion round
        return np.clip(sliding, -most, most)


@dataclass
class LorentzFriction(DryFriction):
    """A limit that falls with the speed as a Lorentz curve."""

    kinetic: float  # limit at high speed, SI unit of the port
    static: float  # limit at rest, SI unit of the port
    speed: float  # half width of the curve

    def limit(self, port: Port) -> Array:
        return self.kinetic + (self.static - self.kinetic) / (1.0 + (port.velocity / self.speed) ** 2)


@dataclass
class TustinFriction(DryFriction):
    """A limit that falls exponentially with the speed."""

    kinetic: float  # limit at high speed, SI unit of the port
    static: float  # limit at rest, SI unit of the port
    speed: float  # speed scale of the fall

    def limit(self, port: Port) -> Array:
        return self.kinetic + (self.static - self.kinetic) * np.exp(-np.abs(port.velocity) / self.speed)


@dataclass
class TightSpot(DryFriction):
    """Dry friction around one position."""

    force: float  # limit at the centre, SI unit of the port
    centre: float  # position of the centre
    width: float  # distance from the centre over which the limit falls

    def limit(self, port: Port) -> Array:
        return self.force * np.exp(-(((port.position - self.centre) / self.width) ** 2))


@dataclass
class GearFriction(DryFriction):
    """Dry friction of a preloaded gear: its limit grows with the force between the teeth."""

    share: float  # limit per force of the drive, at large forces
    preload: float  # force between the teeth without a drive, SI unit of the port

    def limit(self, port: Port) -> Array:
        return np.asarray(self.share * np.hypot(port.load, self.preload))


@dataclass
class RubbingArc(DryFriction):
    """Dry friction over one half of every turn."""

    force: float  # largest limit, SI unit of the port
    phase: float  # angle of the largest limit, rad

    def limit(self, port: Port) -> Array:
        return self.force * np.maximum(0.0, np.cos(port.position - self.phase))


@dataclass
class MaxwellSlip(PortEffect):
    """Presliding friction as parallel springs that slip one after the other.

    The springs have equal stiffness and slip at deflections that grow up to `travel` (Iwan's model).
    """

    force: float  # friction force when all springs slip, SI unit of the port
    travel: float  # deflection at which the last spring slips
    count: int = 6  # of springs
    _spring: Array | None = field(default=None, init=False, repr=False)

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        slips = self.travel * np.arange(1, self.count + 1)[:, None] / self.count
        before = np.zeros((self.count, len(port.velocity))) if self._spring is None else self._spring
        self._spring = np.clip(before + dt * port.velocity, -slips, slips)
        return np.asarray(dt * self.force / float(slips.sum()) * self._spring.sum(axis=0))


@dataclass
class EyringDrag(PortEffect):
    """Viscous friction of a lubricant that thins slightly under shear."""

    damping: float  # friction coefficient at low speed, SI unit of the port
    speed: float  # speed above which the friction grows more slowly

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        return dt * self.damping * self.speed * np.arcsinh(port.velocity / self.speed)


@dataclass
class Windage(PortEffect):
    """Quadratic drag, laminar at low speed."""

    drag: float  # drag coefficient at high speed, SI unit of the port
    speed: float  # speed below which the drag is laminar

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        return dt * self.drag * port.velocity * np.hypot(port.velocity, self.speed)
