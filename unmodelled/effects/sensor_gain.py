"""Gain error of a sensor."""

from __future__ import annotations

from unmodelled.effects.effect import SensorEffect
from unmodelled.effects.law import Amplitude, Law
from unmodelled.effects.place import Site


class SensorGain(SensorEffect):
    """Constant relative error of the sensor's gain."""

    family = "sensor_gain"
    complexity = 1.2

    def law(self, at: Site) -> Law:
        return Law("(1 + g)*y", {"g": Amplitude("y", 0.1, (-0.95, 10.0))})
