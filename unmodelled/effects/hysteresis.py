"""Presliding friction, which builds up over a distance and so has a memory."""

from typing import ClassVar

from unmodelled.effects.effect import PortEffect
from unmodelled.effects.grids import geometric, presliding, relaxation
from unmodelled.effects.law import Amplitude, Law, Memory, Shape, positive
from unmodelled.effects.place import Site

#: Added to the square of z, which is at most one.
_TINY = 1e-9


class _Hysteresis(PortEffect):
    """Effort F_h*z, where z approaches the direction of motion over the distance x_h.

    All rates are divided by x_h + tau*abs(v) instead of x_h: z follows within one sampling period at any
    speed, so that a simulation stays stable for short distances.
    """

    kind = "dry friction"
    family = "hysteresis"
    says = "hysteresis of {F_h}, built up over {x_h}"
    needs = ("velocity",)
    power = "lost over a cycle"
    build_up: ClassVar[str]  # dz/dt times the distance

    def rate(self) -> str:
        """Return dz/dt as an expression; by default it relaxes within one sampling period."""
        return f"({self.build_up})/(x_h + tau*abs(v))"

    def further(self, at: Site) -> tuple[dict[str, Amplitude], dict[str, Shape]]:
        """Return further amplitudes and shapes; none by default."""
        return {}, {}

    def law(self, at: Site) -> Law:
        amplitudes, shapes = self.further(at)
        more = "".join(f" + {name}*({amplitude.adds})" for name, amplitude in amplitudes.items())
        return Law(
            f"F_h*z{more}, x_h*d(z)/dt = {self.build_up}",
            {"F_h": positive("z", at.effort), **amplitudes},
            {"x_h": presliding(at), **shapes},
            {"tau": relaxation(at)},
            {"z": Memory("1", self.rate())},
        )


class Dahl(_Hysteresis):
    """Dahl model of friction with exponent one."""

    variant = "dahl"
    build_up = "v - abs(v)*z"


class BoucWen(_Hysteresis):
    """Bouc-Wen model of friction with a free shape of its loop.

    The way back is as steep as the start of the loop for b_h = 0.5, steeper for a larger b_h, and flatter for
    a smaller one. The loop has sharper corners for a larger exponent n_h. The magnitude of z stays below one.
    """

    variant = "bouc_wen"
    build_up = "v - b_h*abs(v)*z*abs(z)**(n_h - 1) - (1 - b_h)*v*abs(z)**n_h"

    def rate(self) -> str:
        # z**2 plus a small number, because a power of zero has no derivative by n_h; n_h in the denominator,
        # because z approaches one n_h times as fast
        square = f"(z**2 + {_TINY})"
        left = f"b_h*abs(v)*z*{square}**((n_h - 1)/2) + (1 - b_h)*v*{square}**(n_h/2)"
        return f"(v - ({left}))/(x_h + n_h/2*tau*abs(v))"

    def further(self, at: Site) -> tuple[dict[str, Amplitude], dict[str, Shape]]:
        return {}, {"b_h": Shape("1", (0.5,), (0.1, 1.0)), "n_h": Shape("1", (2.0,), (1.0, 5.0))}


class LuGre(_Hysteresis):
    """LuGre model of friction: bristles with a Stribeck curve and their own damping."""

    variant = "lugre"
    build_up = "v - abs(v)*z/(1 + s_b*exp(-(v/v_s)**2))"

    def further(self, at: Site) -> tuple[dict[str, Amplitude], dict[str, Shape]]:
        speed = at["v"].rms
        damping = f"x_h*({self.build_up})/(x_h + tau*abs(v))"
        shapes = {
            "s_b": Shape("1", (0.5,), (0.0, 5.0)),
            "v_s": Shape("v", geometric(0.02 * speed, 0.5 * speed, 3), (1e-3 * speed, 5.0 * speed)),
        }
        return {"d_h": positive(damping, 0.1 * at.effort / speed)}, shapes
