"""Faults of sensors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from pipeline.rigs.withheld.effects.effect import Array, SensorEffect


@dataclass
class ScaleError(SensorEffect):
    """A gain error of the sensor.

    Attributes:
        excess: relative error.
    """

    excess: float

    def seen(self, period: float, y: Array) -> Array:
        return y * (1.0 + self.excess)


@dataclass
class Bias(SensorEffect):
    """An offset of the sensor.

    Attributes:
        bias: offset in the unit of the output.
    """

    bias: float

    def seen(self, period: float, y: Array) -> Array:
        return y + self.bias


@dataclass
class Latency(SensorEffect):
    """A delay of the sensor; at the start it shows the first output.

    Attributes:
        delay: delay, s.
    """

    delay: float

    def seen(self, period: float, y: Array) -> Array:
        t = period * np.arange(len(y))
        return np.asarray(CubicSpline(t, y, axis=0)(np.maximum(t - self.delay, 0.0)))
