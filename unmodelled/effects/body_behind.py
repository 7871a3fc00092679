"""Base class of the effects that hang a body with a motion of its own behind a port."""

from abc import abstractmethod
from collections.abc import Mapping
from typing import ClassVar

from unmodelled.effects.effect import PortEffect
from unmodelled.effects.law import Amplitude, Fixed, Law, Memory, Shape, Told, positive
from unmodelled.effects.place import Site

#: Of the mass that the port feels: the most that can lie behind the connection.
_MOST = 0.95


class BodyBehind(PortEffect):
    """Body of mass m_b behind a connection, with position x_b and speed v_b; it starts like the port."""

    needs = ("position", "velocity", "mass")
    pushed: ClassVar[str]  # acceleration of the body, from x, v, x_b, v_b and the numbers of the connection
    told: ClassVar[Mapping[str, Told]] = {}  # of the numbers of the connection
    phrase: ClassVar[str]  # the connection, see `Law`
    is_part: ClassVar[bool]  # of the known mass; else the body comes to it

    @abstractmethod
    def connection(self, at: Site) -> tuple[dict[str, Shape], dict[str, Fixed]]:
        """Return the numbers of the connection that are fitted, and those that are not.

        Args:
            at: place of the effect, with the sizes of its signals.
        """

    def law(self, at: Site) -> Law:
        mass, pushed = 1.0 / at.mobility, self.pushed
        shapes, fixed = self.connection(at)
        if self.is_part:
            text, behind = "m_b*(d(v_b)/dt - d(v)/dt)", "{m_b} behind it"
            amplitude, whole = Amplitude(f"{pushed} - a", 0.1 * mass, (0.0, _MOST * mass)), mass
        else:
            text, behind = "m_b*d(v_b)/dt", "{m_b} behind it that the model lacks"
            amplitude, whole = positive(pushed, 0.1 * mass), None
        return Law(
            f"{text}, d(v_b)/dt = {pushed}, d(x_b)/dt = v_b",
            {"m_b": amplitude},
            shapes,
            fixed,
            {"x_b": Memory("x", "v_b", start="x"), "v_b": Memory("v", pushed, start="v")},
            told={"m_b": Told("behind it", whole=whole), **self.told},
            phrase=f"{self.phrase}; {behind}",
        )
