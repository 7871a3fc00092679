"""Saturation of an actuator at a largest output."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import ClassVar

from unmodelled.effects.effect import DriveEffect
from unmodelled.effects.grids import geometric
from unmodelled.effects.law import Law, Shape, share
from unmodelled.effects.place import Site

#: How many limits are tried, from this part of the largest input on.
_LIMITS, _LEAST = 6, 0.15


class _Saturation(DriveEffect):
    family = "actuator_saturation"
    said: ClassVar[Mapping[str, str]] = {}

    @abstractmethod
    def limited(self) -> tuple[str, float]:
        """Return the limited input as an expression, and the highest limit with an influence, in largest
        inputs.
        """

    def law(self, at: Site) -> Law:
        limited, most = self.limited()
        largest = max(abs(at["u"].low), abs(at["u"].high), at["u"].rms)
        grid = geometric(_LEAST * largest, 0.9 * most * largest, _LIMITS)
        shapes = {"u_max": Shape("u", grid, (0.01 * largest, most * largest))}
        return Law(limited, {"c_u": share(f"{limited} - u")}, shapes, robot=self.said)


class HardSaturation(_Saturation):
    """Saturation at the same limit on both sides."""

    complexity = 2.0
    said: ClassVar[Mapping[str, str]] = {
        "ctrl_low": "max(ctrl_low, -u_max)",
        "ctrl_high": "min(ctrl_high, u_max)",
    }

    def limited(self) -> tuple[str, float]:
        return "clip(u, -u_max, u_max)", 1.0


class SoftSaturation(_Saturation):
    """Saturation that approaches its limit gradually."""

    variant = "soft"
    complexity = 2.2

    def limited(self) -> tuple[str, float]:
        return "u_max*tanh(u/u_max)", 4.0
