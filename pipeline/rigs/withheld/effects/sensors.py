"""Faults of sensors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from pipeline.rigs.withheld.effects.effect import Array, SensorEffect


@dataclass
class ScaleError(SensorEffect):
    """Shows too much by the share `excess`."""

    excess: float

    def seen(self, period: float, y: Array) -> Array:
        return y * (1.0 + self.excess)


@dataclass
class Bias(SensorEffect):
    """Shows `bias` too much."""

    bias: float

    def seen(self, period: float, y: Array) -> Array:
        return y + self.bias


@dataclass
class Latency(SensorEffect):
    """Shows what was `delay` seconds ago; at the start, what was then."""

    delay: float

    def seen(self, period: float, y: Array) -> Array:
        t = period * np.arange(len(y))
        return np.asarray(CubicSpline(t, y, axis=0)(np.maximum(t - self.delay, 0.0)))
