"""What every family of effects answers, and what families at one kind of place share."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar, Literal

from unmodelled.effects.added import Added
from unmodelled.effects.attach import attached
from unmodelled.effects.law import Law
from unmodelled.effects.place import Place, Site, site
from unmodelled.effects.scales import Scales
from unmodelled.systems.model import Port, System

#: What an effort does with the power that it takes out of the system: it loses it at every moment, or over a
#: cycle of its position, or gives all of it back over a cycle.
Power = Literal["lost", "lost over a cycle", "stored"]


class Effect(ABC):
    """An effect that a model may leave out. Stateless; a class without abstract methods is in the library.

    Class attributes:
        family: its name in a diagnosis. variant: which of several of one family, or "".
        complexity: how much it takes to believe in it; of effects that data cannot tell apart, the simplest
            is the one with the least. About how many numbers it has, more for memory and for what is rare.
    """

    family: ClassVar[str]
    variant: ClassVar[str] = ""
    complexity: ClassVar[float]

    @abstractmethod
    def places(self, system: System) -> tuple[Place, ...]:
        """Where it can act in `system`."""

    @abstractmethod
    def add(self, system: System, place: Place, scales: Scales) -> Added:
        """`system` with the effect at `place`, at level zero; `system` may have effects already.

        Raises:
            KeyError: when the system has no such place.
        """


class LawEffect(Effect):
    """An effect that a law describes."""

    @abstractmethod
    def law(self, at: Site) -> Law:
        """The law at a place, its grids chosen from the sizes there."""

    def add(self, system: System, place: Place, scales: Scales) -> Added:
        where = site(system, place, scales)
        return attached(where, self.law(where), self.family, self.variant)


class PortEffect(LawEffect):
    """An effort on a port; positive where it takes power out of the system.

    Class attributes:
        needs: coordinates that the port must have.
        power: what it does with that power, None where that depends.
    """

    needs: ClassVar[tuple[Literal["position", "velocity"], ...]] = ()
    power: ClassVar[Power | None] = None

    def suits(self, system: System, port: Port) -> bool:
        """Whether it can act on `port`."""
        return all(getattr(port, coordinate) is not None for coordinate in self.needs)

    def places(self, system: System) -> tuple[Place, ...]:
        return tuple(Place("port", port.name) for port in system.ports if self.suits(system, port))


class ActuatorEffect(LawEffect):
    """Something that happens to an input between the log and the physics."""

    def places(self, system: System) -> tuple[Place, ...]:
        return tuple(Place("actuator", item.name) for item in system.inputs)


class SensorEffect(LawEffect):
    """Something that happens to an output between the physics and the log."""

    def places(self, system: System) -> tuple[Place, ...]:
        return tuple(Place("sensor", item.name) for item in system.outputs)


class ParameterEffect(LawEffect):
    """A parameter that is not the same always; those that the file marks as uncertain come first."""

    def places(self, system: System) -> tuple[Place, ...]:
        ordered = sorted(system.parameters, key=lambda parameter: not parameter.identify)
        return tuple(Place("parameter", parameter.name) for parameter in ordered)
