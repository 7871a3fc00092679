"""Flows out of a balance of fluid, heat or charge, and what a cell and a winding lack."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from pipeline.rigs.withheld.effects.effect import Effect, Port, PortEffect
from unmodelled.base.arrays import Array


@dataclass
class Orifice(PortEffect):
    """Opening with a turbulent flow, which becomes laminar at low levels."""

    flow: float  # flow at the level `scale`
    scale: float  # level of the flow
    laminar: float  # level below which the flow is laminar

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        level = port.position
        return dt * self.flow * level / np.sqrt(self.scale * np.hypot(level, self.laminar))


@dataclass
class Gap(PortEffect):
    """Leak through a gap that the level widens a little."""

    conductance: float  # flow per level at the level zero
    widening: float  # relative increase of the conductance per level

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        return dt * self.conductance * port.position * (1.0 + self.widening * port.position)


@dataclass
class ReliefValve(PortEffect):
    """Valve that opens softly above a level."""

    conductance: float  # flow per level above the opening
    opening: float  # level at which the valve opens
    softness: float  # width of the transition, unit of the level
    power: float = 1.0  # exponent of the flow: 1 for a valve, 1.5 for an edge
    scale: float = 1.0  # level above the opening at which the exponent changes nothing

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        above = self.softness * np.logaddexp(0.0, (port.position - self.opening) / self.softness)
        return dt * self.conductance * self.scale * (above / self.scale) ** self.power


@dataclass
class SecondStore(PortEffect):
    """Store behind a passage; it starts at the level of the port."""

    conductance: float  # flow per difference of the levels
    capacity: float  # content per level
    #: Difference of the levels from which on the flow grows less than in proportion; 0: never
    rough: float = 0.0
    _level: Array | None = field(default=None, init=False, repr=False)

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        level = port.position if self._level is None else self._level
        drop = port.position - level
        narrow = (1.0 + (drop / self.rough) ** 2) ** -0.1 if self.rough else 1.0
        passed = dt * self.conductance * drop * narrow
        self._level = level + passed / self.capacity
        return np.asarray(passed)


@dataclass
class Radiator(PortEffect):
    """Heat that a metal radiates: its emissivity grows with the temperature."""

    power: float  # power at the temperature `scale` of the body, W
    scale: float  # temperature of this power, K
    around: float  # temperature of the surroundings, K

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        own, around = port.position / self.scale, self.around / self.scale
        return np.asarray(dt * self.power * (own**4.3 - around**4.3))


@dataclass
class HotCopper(PortEffect):
    """Resistance of a winding that its losses heat; the winding passes heat to its core."""

    resistance: float  # resistance of the cold winding, ohm
    rise: float  # relative increase of the resistance for each W of losses at rest
    winding: float  # time constant of the winding, s
    core: float  # time constant of the core, s
    share: float = 0.2  # share of the core in the increase
    _warm: tuple[Array, Array] | None = field(default=None, init=False, repr=False)

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        current = port.position
        winding, core = (np.zeros_like(current),) * 2 if self._warm is None else self._warm
        more = self.rise * ((1.0 - self.share) * winding + self.share * core)
        losses = self.resistance * (1.0 + more) * current**2
        self._warm = (
            winding + dt * (losses - winding) / self.winding,
            core + dt * (losses - core) / self.core,
        )
        return np.asarray(dt * self.resistance * more * current)


@dataclass
class Polarisation(PortEffect):
    """Voltage that a current builds up in two branches, beside the resistance of a cell."""

    slow: float  # resistance of the slow branch, ohm
    slow_time: float  # s
    fast: float  # resistance of the fast branch, ohm
    fast_time: float  # s
    _voltage: tuple[Array | float, Array | float] = field(default=(0.0, 0.0), init=False, repr=False)

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        slow, fast = self._voltage
        more = (
            dt * (self.slow * port.load - slow) / self.slow_time,
            dt * (self.fast * port.load - fast) / self.fast_time,
        )
        self._voltage = slow + more[0], fast + more[1]
        return np.asarray((more[0] + more[1]) / port.mobility)


@dataclass
class IronCore(Effect):
    """Inductance that falls with the current."""

    lost: float  # inductance that is lost at high currents, H
    knee: float  # current at which much of it is lost, A

    def refitted(self, machine: Any) -> Any:
        return replace(machine, lost=self.lost, knee=self.knee)
