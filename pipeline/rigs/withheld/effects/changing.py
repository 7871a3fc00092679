"""Effects that change with time, or between runs."""

from dataclasses import dataclass

import numpy as np

from pipeline.rigs.withheld.effects.effect import ActuatorEffect, Make, Port, PortEffect
from unmodelled.base.arrays import Array


@dataclass
class WarmingBearing(PortEffect):
    """Viscous friction that changes exponentially as a bearing warms up."""

    change: float  # final change of the friction coefficient, SI unit of the port
    time: float  # time constant, s
    begin: Array  # (n,), start of every run since the start of the campaign, s

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        return dt * self.change * (1.0 - np.exp(-(self.begin + t) / self.time)) * port.velocity


@dataclass
class FadingDrive(ActuatorEffect):
    """A drive that loses strength exponentially as it warms up."""

    fall: float  # final relative loss
    time: float  # time constant, s
    begin: Array  # (n,), start of every run since the start of the campaign, s

    def applied(self, dt: float, t: float, u: Array) -> Array:
        return u * (1.0 - self.fall * (1.0 - np.exp(-(self.begin + t) / self.time)))


@dataclass
class ScatteredDamping(PortEffect):
    """Viscous friction that differs between runs."""

    excess: Array  # (n,), change of the friction coefficient, SI unit of the port

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        return dt * self.excess * port.velocity


def spread(runs: int, rng: np.random.Generator) -> Array:
    """Draw values of mean zero and mean square one, none beyond about two; gives (runs,)."""
    values = rng.uniform(-1.0, 1.0, runs)
    values -= values.mean()
    return np.asarray(values / np.sqrt(np.mean(values**2)))


def scattered_damping(typical: float, least: float) -> Make:
    """Draw viscous friction that differs between runs, none of it below `least`."""
    return lambda a, plan, rng: ScatteredDamping(np.maximum(least, typical * a * spread(plan.runs, rng)))


def fading_drive(typical: float, time: float) -> Make:
    """Make a drive that loses at most 60 % of its strength."""
    return lambda a, plan, _: FadingDrive(min(typical * a, 0.6), time, plan.begin)
