"""End stops of the travel."""

from typing import ClassVar

from unmodelled.effects.effect import PortEffect
from unmodelled.effects.law import Fixed, Law, Shape, positive
from unmodelled.effects.place import Site

#: Where a stop may begin, in parts of the half travel before its end.
_DEPTHS = (0.01, 0.03, 0.1, 0.3, 0.6)
#: Of the half travel: the depth that forces are given for.
_DENT = 0.1


class _EndStop(PortEffect):
    """Contact of Hunt and Crossley: force by a power of the depth (1.5 for Hertzian contact), damping by
    depth.
    """

    kind = "elasticity"
    family = "end_stop"
    needs = ("position", "velocity")
    power = "lost over a cycle"
    ends: ClassVar[tuple[str, ...]]  # names of the positions where the contact begins

    def law(self, at: Site) -> Law:
        low, high, half = at["x"].low, at["x"].high, at["x"].half
        starts = {
            "x_l": Shape("x", tuple(low + depth * half for depth in _DEPTHS), (low - half, high)),
            "x_h": Shape("x", tuple(high - depth * half for depth in _DEPTHS), (low, high + half)),
        }
        depth = {"x_l": "max(x_l - x, 0)/x_d", "x_h": "max(x - x_h, 0)/x_d"}
        sign = {"x_l": "-", "x_h": ""}
        force = " + ".join(f"{sign[end]}({depth[end]})**n" for end in self.ends)
        damped = f"({' + '.join(depth[end] for end in self.ends)})*v"
        amplitudes = {
            "F_s": positive(f"({force})", at.effort),
            "d": positive(damped, at.effort / at["v"].rms),
        }
        shapes = {end: starts[end] for end in self.ends} | {"n": Shape("1", (1.2,), (1.0, 3.0))}
        fixed = {"x_d": Fixed("x", _DENT * half)}
        return Law(f"F_s*({force}) + d*{damped}", amplitudes, shapes, fixed)


class UpperStop(_EndStop):
    """Stop at the upper end of the travel."""

    variant = "upper"
    says = "stop at {x_h}"
    ends = ("x_h",)


class LowerStop(_EndStop):
    """Stop at the lower end of the travel."""

    variant = "lower"
    says = "stop at {x_l}"
    ends = ("x_l",)


class BothStops(_EndStop):
    """Equal stops at both ends of the travel."""

    variant = "both"
    says = "stops at {x_l} and {x_h}"
    ends = ("x_l", "x_h")
