"""Stops at the ends of the travel."""

from __future__ import annotations

from abc import abstractmethod

from pipeline.physics.effects.effect import PortEffect
from pipeline.physics.effects.law import Law, Shape, positive
from pipeline.physics.effects.place import Site

#: Where a stop may begin, in parts of the half travel before its end.
_DEPTHS = (0.01, 0.03, 0.1, 0.3, 0.6)
#: Of the half travel: the depth that a stop is dented by.
_DENT = 0.01


class _EndStop(PortEffect):
    """Hunt and Crossley's contact: stiffness, and damping in proportion to the depth, which never pulls."""

    family = "end_stop"
    needs = ("position", "velocity")
    power = "lost over a cycle"

    @property
    @abstractmethod
    def ends(self) -> tuple[str, ...]:
        """Names of the positions where it begins."""

    def law(self, at: Site) -> Law:
        low, high, half = at["x"].low, at["x"].high, at["x"].half
        starts = {
            "x_l": Shape("x", tuple(low + depth * half for depth in _DEPTHS), (low - half, low + half)),
            "x_h": Shape("x", tuple(high - depth * half for depth in _DEPTHS), (high - half, high + half)),
        }
        beyond = {"x_l": "min(x - x_l, 0)", "x_h": "max(x - x_h, 0)"}
        depth = " + ".join(beyond[end] for end in self.ends)
        depth = f"({depth})" if len(self.ends) > 1 else depth
        damped = f"abs({depth})*v"
        stiffness = at.effort / (_DENT * half)
        amplitudes = {"k": positive(depth, stiffness), "d": positive(damped, stiffness / at["v"].rms)}
        return Law(f"k*{depth} + d*{damped}", amplitudes, {end: starts[end] for end in self.ends})


class UpperStop(_EndStop):
    """At the upper end."""

    variant = "upper"
    complexity = 2.5

    @property
    def ends(self) -> tuple[str, ...]:
        return ("x_h",)


class LowerStop(_EndStop):
    """At the lower end."""

    variant = "lower"
    complexity = 2.5

    @property
    def ends(self) -> tuple[str, ...]:
        return ("x_l",)


class BothStops(_EndStop):
    """At both ends, alike."""

    variant = "both"
    complexity = 3.5

    @property
    def ends(self) -> tuple[str, ...]:
        return ("x_l", "x_h")
