"""Delays of inputs and outputs."""

from collections.abc import Mapping

from unmodelled.effects.added import Added
from unmodelled.effects.effect import USUAL_PERIODS, Effect
from unmodelled.effects.naming import fresh
from unmodelled.effects.place import Place
from unmodelled.effects.scales import Scales
from unmodelled.systems.model import System

#: Sampling periods that are tried.
_PERIODS = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0)
#: Of the longest experiment: the longest delay.
_LONGEST = 0.2


class Delay(Effect):
    """Delay in addition to the known one; it is not a parameter of the equations (see `with_numbers`)."""

    kind = "timing"

    def usual(self, added: Added, period: float) -> Mapping[str, float]:
        return dict.fromkeys(added.delays, USUAL_PERIODS * period)

    def add(self, system: System, place: Place, scales: Scales) -> Added:
        items = system.inputs if place.kind == "actuator" else system.outputs
        if place.factor is not None:
            raise ValueError("a delay cannot belong to some of the experiments")
        if place.name not in {item.name for item in items}:
            raise KeyError(place.name)
        # no parameter of the system tells which names of delays are taken: each has that of its place
        own = f"T_d_{place.name}"
        name = fresh(system, [own], place.name)[own]
        longest = max(_LONGEST * scales.duration, scales.period)
        grid = tuple(k * scales.period for k in _PERIODS if k * scales.period <= longest)
        return Added(
            self.family,
            self.variant,
            place,
            system,
            law=f"{place.name}(t - {name})",
            shapes={name: grid},
            bounds={name: (0.0, longest)},
            scales={name: scales.period},
            units={name: "s"},
            delays={name: place},
        )


class InputDelay(Delay):
    """Constant delay between the logged input and its action."""

    family = "input_delay"

    def places(self, system: System) -> tuple[Place, ...]:
        return tuple(Place("actuator", item.name) for item in system.inputs)


class SensorDelay(Delay):
    """Constant delay between a quantity and its log."""

    family = "sensor_delay"

    def places(self, system: System) -> tuple[Place, ...]:
        return tuple(Place("sensor", item.name) for item in system.outputs)
