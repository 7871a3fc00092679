"""Nonlinear springs."""

from typing import ClassVar

from unmodelled.effects.effect import PortEffect
from unmodelled.effects.grids import geometric, inside, polynomial
from unmodelled.effects.law import Fixed, Law, Shape, Told, positive, signed
from unmodelled.effects.place import Site


class _Spring(PortEffect):
    kind = "elasticity"
    family = "nonlinear_spring"
    needs = ("position",)
    power = "stored"


class HardeningSpring(_Spring):
    """Duffing spring: a stiffness that grows, or falls, with the square of position."""

    variant = "hardening"
    says = "stiffness of {k} at the middle, with a cubic part of {k_3}"
    says_negative = "negative stiffness of {k} at the middle, with a cubic part of {k_3}"

    def law(self, at: Site) -> Law:
        size = at["x"].rms
        amplitudes = {"k": signed("x", at.effort / size), "k_3": signed("x**3", at.effort / size**3)}
        return Law("k*x + k_3*x**3", amplitudes, fitted_along="x")


class PolynomialSpring(_Spring):
    """Spring with any smooth characteristic: a polynomial of order four about the middle of the travel."""

    variant = "polynomial"
    says = "effort that changes by {F_1} over half of the travel"

    def law(self, at: Site) -> Law:
        return polynomial(at, "F", 4)


class _OneSided(_Spring):
    """Spring in contact beyond a position: linear for n = 1, stiffer with depth for n > 1."""

    sign: ClassVar[str]  # of the force
    depth: ClassVar[str]  # of the contact, in tenths of the half travel

    def law(self, at: Site) -> Law:
        low, high, half = at["x"].low, at["x"].high, at["x"].half
        shapes = {
            "x_0": Shape("x", inside(low, high, 5), (low - half, high + half)),
            "n": Shape("1", (1.1,), (1.0, 3.0)),
        }
        adds = f"({self.sign}({self.depth})**n)"
        return Law(f"F_s*{adds}", {"F_s": positive(adds, at.effort)}, shapes, {"x_d": Fixed("x", 0.1 * half)})


class OneSidedSpringAbove(_OneSided):
    """Spring in contact above a position."""

    variant = "one_sided_above"
    says = "contact from {x_0} upwards"
    sign, depth = "", "max(x - x_0, 0)/x_d"


class OneSidedSpringBelow(_OneSided):
    """Spring in contact below a position."""

    variant = "one_sided_below"
    says = "contact from {x_0} downwards"
    sign, depth = "-", "max(x_0 - x, 0)/x_d"


class SpringWithPlay(_Spring):
    """Spring in contact on both sides of a gap of 2*delta about x_0."""

    variant = "play"

    def law(self, at: Site) -> Law:
        half, middle = at["x"].half, at["x"].middle
        beyond = "(x - x_0 - clip(x - x_0, -delta, delta))"
        shapes = {
            "delta": Shape("x", geometric(0.03 * half, 0.6 * half, 4), (0.0, half)),
            "x_0": Shape(
                "x", tuple(middle + s * half for s in (-0.5, 0.0, 0.5)), (at["x"].low, at["x"].high)
            ),
        }
        play = Told("play from stop to stop", "2*{0}", 2.0)
        return Law(
            *(f"k*{beyond}", {"k": positive(beyond, at.effort / half)}, shapes),
            told={"delta": play},
            phrase="spring of {k} with {delta} of play from stop to stop",
        )
