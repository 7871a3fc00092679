"""Delay of an input."""

from unmodelled.effects.delay import Delay
from unmodelled.effects.place import Place
from unmodelled.systems.model import System


class InputDelay(Delay):
    """Constant delay between the logged input and its action."""

    family = "input_delay"

    def places(self, system: System) -> tuple[Place, ...]:
        return tuple(Place("actuator", item.name) for item in system.inputs)
