"""Base class of the effects that hang a body with a motion of its own behind a port."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import ClassVar

from unmodelled.effects.effect import PortEffect
from unmodelled.effects.law import Amplitude, Fixed, Law, Memory, Shape, Told, positive
from unmodelled.effects.motion import is_inertial
from unmodelled.effects.place import Site
from unmodelled.systems.model import Port, System

#: Of the mass that the port feels: the most that can lie behind the connection.
_MOST = 0.95


class BodyBehind(PortEffect):
    """Body of mass m_b behind a connection, with position x_b and speed v_b; it starts like the port.

    Attributes:
        pushed: acceleration of the body, from x, v, x_b, v_b and the numbers of the connection.
        told: words of the trade for the numbers of the connection, see `Told`.
        phrase: the connection in a few words, see `Law`.
        behind: the mass of the body in words.
    """

    needs = ("position", "velocity")
    pushed: ClassVar[str]
    told: ClassVar[Mapping[str, Told]] = {}
    phrase: ClassVar[str]
    behind: ClassVar[str]

    @abstractmethod
    def connection(self, at: Site) -> tuple[dict[str, Shape], dict[str, Fixed]]:
        """Return the numbers of the connection that are fitted, and those that are not.

        Args:
            at: place of the effect, with the sizes of its signals.
        """

    @abstractmethod
    def effort(self, mass: float) -> tuple[str, Amplitude, Told]:
        """Return the effort on the port, as text and as amplitude, and what is said of the mass.

        Args:
            mass: mass or moment of inertia that the port feels, SI.
        """

    def suits(self, system: System, port: Port) -> bool:
        return super().suits(system, port) and is_inertial(system, port)

    def law(self, at: Site) -> Law:
        text, amplitude, told = self.effort(1.0 / at.mobility)
        shapes, fixed = self.connection(at)
        return Law(
            f"{text}, d(v_b)/dt = {self.pushed}, d(x_b)/dt = v_b",
            {"m_b": amplitude},
            shapes,
            fixed,
            {"x_b": Memory("x", "v_b", start="x"), "v_b": Memory("v", self.pushed, start="v")},
            told={"m_b": told, **self.told},
            phrase=f"{self.phrase}; {self.behind}",
        )


class PartBehind(BodyBehind):
    """Body that is part of the known mass."""

    behind = "{m_b} behind it"

    def effort(self, mass: float) -> tuple[str, Amplitude, Told]:
        amplitude = Amplitude(f"{self.pushed} - a", 0.1 * mass, (0.0, _MOST * mass))
        return "m_b*(d(v_b)/dt - d(v)/dt)", amplitude, Told("behind it", whole=mass)


class LoadBehind(BodyBehind):
    """Body that comes to the known mass."""

    behind = "{m_b} behind it that the model lacks"

    def effort(self, mass: float) -> tuple[str, Amplitude, Told]:
        return "m_b*d(v_b)/dt", positive(self.pushed, 0.1 * mass), Told("behind it")
