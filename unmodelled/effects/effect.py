"""Base classes of all effects, one per kind of place."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import ClassVar, Literal

from unmodelled.effects.added import Added
from unmodelled.effects.attach import attached
from unmodelled.effects.known_terms import stiffness
from unmodelled.effects.law import Law
from unmodelled.effects.load import carries
from unmodelled.effects.motion import is_inertial
from unmodelled.effects.place import Kind, Place, Site, site
from unmodelled.effects.scales import Scales
from unmodelled.effects.surroundings import surroundings
from unmodelled.systems.model import Domain, Port, System

#: Sampling periods by which signals are usually late, one standard deviation: a controller acts on the last
#: sample, and its drive on the next one.
USUAL_PERIODS = 3.0
#: What a law is about, so that a reader knows what to look at: laws of one kind at one place are often one
#: answer.
LawKind = Literal[
    "dry friction",
    "damping",
    "loss",
    "storage",
    "elasticity",
    "play",
    "load",
    "number",
    "drive",
    "sensor",
    "timing",
    "curve",
]
#: Kinds whose laws are no forms of one thing: a drive may be loose, weak backwards and limited at once.
DISTINCT: frozenset[LawKind] = frozenset({"drive", "sensor", "load"})
#: What an effort does with the power that it takes out of the system: it loses it at every moment, or over a
#: cycle of its position, or gives all of it back over a cycle.
Power = Literal["lost", "lost over a cycle", "stored"]
#: What a law can need of a port: a coordinate, a mass that it feels, a load, a spring of the known physics
#: beside it, or a known level of its surroundings.
Need = Literal["position", "velocity", "mass", "load", "spring", "surroundings"]
_GIVEN: Mapping[Need, Callable[[System, Port], bool]] = {
    "position": lambda system, port: port.position is not None,
    "velocity": lambda system, port: port.velocity is not None,
    "mass": is_inertial,
    "load": carries,
    "spring": lambda system, port: stiffness(system, port) is not None,
    "surroundings": lambda system, port: surroundings(system, port) is not None,
}


class Effect(ABC):
    """Effect that a model can leave out; stateless.

    Every class of this package without abstract methods that takes no arguments is in the library, unless its
    name begins with an underscore.

    Attributes:
        family: name of the family in a diagnosis.
        variant: name of the variant within the family; empty for the plain form.
        beside: families of which one must have been added at the same place; empty (default) if none must.
        at_levels: whether it acts at levels of factors only; default False.
        kind: subject of the law, such as dry friction.
    """

    family: str
    variant: str = ""
    beside: ClassVar[frozenset[str]] = frozenset()
    at_levels: ClassVar[bool] = False
    kind: ClassVar[LawKind]

    @abstractmethod
    def places(self, system: System) -> tuple[Place, ...]:
        """Return the places where the effect can act.

        Args:
            system: system to search.

        Returns:
            Places of the system.
        """

    @abstractmethod
    def add(self, system: System, place: Place, scales: Scales) -> Added:
        """Return the system with the effect at a place, at level zero.

        Args:
            system: system, possibly with other effects.
            place: place where the effect acts.
            scales: magnitudes of the system's quantities in the logs.

        Returns:
            System with the effect, and the numbers that a fit needs.

        Raises:
            KeyError: if the system has no such place.
        """

    def usual(self, added: Added, period: float) -> Mapping[str, float]:
        """Return how large the numbers of the effect are in every log, as part of its measurement chain.

        Args:
            added: effect at a place.
            period: sampling period in s.

        Returns:
            Standard deviations by number, in SI units; empty (default) for effects that most machines lack.
        """
        return {}


class LawEffect(Effect):
    """Effect that is described by a law."""

    #: The effect in a few words, as `phrase` and `negative` of a law that has none of its own.
    says: ClassVar[str] = ""
    says_negative: ClassVar[str] = ""

    @abstractmethod
    def law(self, at: Site) -> Law:
        """Return the law at a place, with starting values chosen from the magnitudes there.

        Args:
            at: place with the magnitudes of its quantities.

        Returns:
            Law in local names.
        """

    def add(self, system: System, place: Place, scales: Scales) -> Added:
        where = site(system, place, scales)
        law = self.law(where)
        if self.says and not law.phrase:
            law = replace(law, phrase=self.says, negative=self.says_negative)
        return attached(where, law, self.family, self.variant)


class PortEffect(LawEffect):
    """Effort on a port; positive if it takes power out of the system.

    Attributes:
        needs: properties that the port must have for the law; default none.
        power: whether the effort loses or stores energy; None (default) if that depends on the motion.
        domains: kinds of ports (see `Port`) that the law makes sense for; default those of mechanics.
    """

    kind: ClassVar[LawKind] = "curve"
    needs: ClassVar[tuple[Need, ...]] = ()
    power: ClassVar[Power | None] = None
    domains: ClassVar[tuple[Domain, ...]] = ("power",)

    def suits(self, system: System, port: Port) -> bool:
        """Return whether the effect can act on a port.

        Args:
            system: system of the port.
            port: port to check.

        Returns:
            True if the port has all that the law needs.
        """
        return port.domain in self.domains and all(_GIVEN[need](system, port) for need in self.needs)

    def places(self, system: System) -> tuple[Place, ...]:
        return tuple(Place("port", port.name) for port in system.ports if self.suits(system, port))


class ActuatorEffect(LawEffect):
    """Change of an input between the log and the physics."""

    kind: ClassVar[LawKind] = "drive"

    def places(self, system: System) -> tuple[Place, ...]:
        return tuple(Place("actuator", item.name) for item in system.inputs)


class DriveEffect(ActuatorEffect):
    """Change of a set point by the drive; none lies between a measured input and the physics."""

    def places(self, system: System) -> tuple[Place, ...]:
        return tuple(Place("actuator", item.name) for item in system.inputs if item.commanded)


class SensorEffect(LawEffect):
    """Change of an output between the physics and the log."""

    kind: ClassVar[LawKind] = "sensor"

    def places(self, system: System) -> tuple[Place, ...]:
        return tuple(Place("sensor", item.name) for item in system.outputs)


class ParameterEffect(LawEffect):
    """Parameter that is not constant; parameters marked as uncertain in the file are tried first."""

    kind: ClassVar[LawKind] = "number"

    def places(self, system: System) -> tuple[Place, ...]:
        constant = (parameter for parameter in system.parameters if not parameter.per_experiment)
        ordered = sorted(constant, key=lambda parameter: not parameter.identify)
        return tuple(Place("parameter", parameter.name) for parameter in ordered)


#: What a law is about by the kind of its place, where no law of the library says more.
PLACE_KINDS: Mapping[Kind, LawKind] = {
    "port": PortEffect.kind,
    "actuator": ActuatorEffect.kind,
    "sensor": SensorEffect.kind,
    "parameter": ParameterEffect.kind,
}
