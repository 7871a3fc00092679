"""Faults of sensors."""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from pipeline.rigs.withheld.effects.effect import SensorEffect
from unmodelled.base.arrays import Array


@dataclass
class ScaleError(SensorEffect):
    """A gain error of the sensor."""

    excess: float  # share

    def seen(self, period: float, y: Array) -> Array:
        return y * (1.0 + self.excess)


@dataclass
class Bias(SensorEffect):
    """An offset of the sensor."""

    bias: float  # unit of the output

    def seen(self, period: float, y: Array) -> Array:
        return y + self.bias


@dataclass
class Latency(SensorEffect):
    """A delay of the sensor; at the start it shows the first output."""

    delay: float  # s

    def seen(self, period: float, y: Array) -> Array:
        t = period * np.arange(len(y))
        return np.asarray(CubicSpline(t, y, axis=0)(np.maximum(t - self.delay, 0.0)))


@dataclass
class LowPass(SensorEffect):
    """A second-order low-pass filter with one pole at 1 / time and one five times as fast."""

    time: float  # larger time constant, s

    def seen(self, period: float, y: Array) -> Array:
        fast = _filtered(y, period, self.time / 5.0)
        return _filtered(fast, period, self.time)


def _filtered(y: Array, period: float, time: float) -> Array:
    """Return a first-order filter of values that run straight between samples."""
    keep = float(np.exp(-period / time))
    late = time * np.diff(y, axis=0) / period
    found = np.empty_like(y)
    found[0] = y[0]
    for k in range(len(late)):
        found[k + 1] = y[k + 1] - late[k] + keep * (found[k] - y[k] + late[k])
    return found
