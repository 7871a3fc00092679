"""What is not the same all the time, or not in every run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.rigs.withheld.effects.effect import ActuatorEffect, Array, Port, PortEffect


@dataclass
class WarmingBearing(PortEffect):
    """Viscous friction changes by up to `change`, time constant `time`; run i starts at `begin`[i]."""

    change: float
    time: float
    begin: Array

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        return dt * self.change * (1.0 - np.exp(-(self.begin + t) / self.time)) * port.velocity


@dataclass
class FadingDrive(ActuatorEffect):
    """The drive loses up to the share `fall` of its strength as it warms up, time constant `time`."""

    fall: float
    time: float
    begin: Array

    def applied(self, dt: float, t: float, u: Array) -> Array:
        return u * (1.0 - self.fall * (1.0 - np.exp(-(self.begin + t) / self.time)))


@dataclass
class ScatteredDamping(PortEffect):
    """Viscous friction differs by `excess`[i] in run i."""

    excess: Array

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        return dt * self.excess * port.velocity


def spread(runs: int, rng: np.random.Generator) -> Array:
    """Return (n,) values of mean zero and mean square one, none beyond about two."""
    values = rng.uniform(-1.0, 1.0, runs)
    values -= values.mean()
    return np.asarray(values / np.sqrt(np.mean(values**2)))


def scattered_damping(size: float, least: float, runs: int, rng: np.random.Generator) -> ScatteredDamping:
    """Return viscous friction that differs by `size` (rms) between runs, not below `least` (negative)."""
    return ScatteredDamping(np.maximum(least, size * spread(runs, rng)))
