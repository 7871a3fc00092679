"""Offset of a sensor."""

from unmodelled.effects.effect import SensorEffect
from unmodelled.effects.law import Law, signed
from unmodelled.effects.place import Site


class SensorOffset(SensorEffect):
    """Constant added to the measured quantity."""

    family = "sensor_offset"
    complexity = 1.2

    def law(self, at: Site) -> Law:
        return Law("y + y_0", {"y_0": signed("1", 0.1 * at["y"].rms)})
