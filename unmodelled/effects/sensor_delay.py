"""Delay of a sensor."""

from unmodelled.effects.delay import Delay
from unmodelled.effects.place import Place
from unmodelled.systems.model import System


class SensorDelay(Delay):
    """Constant delay between a quantity and its log."""

    family = "sensor_delay"

    def places(self, system: System) -> tuple[Place, ...]:
        return tuple(Place("sensor", item.name) for item in system.outputs)
