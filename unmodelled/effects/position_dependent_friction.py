"""Friction that depends on position, as of a bent guide, a tight spot or an eccentric seal."""

from abc import abstractmethod
from math import pi
from typing import ClassVar

from unmodelled.effects.effect import LawKind, PortEffect
from unmodelled.effects.grids import creep, inside, waves
from unmodelled.effects.law import Fixed, Law, Shape, positive
from unmodelled.effects.place import Site

#: Directions of the tightest spot of a turn, where fitting starts.
_PHASES = tuple(k * pi / 4 for k in range(8))


#: F(x) as text; by what, never negative, each of its amplitudes is multiplied; shapes and fixed numbers.
Level = tuple[str, dict[str, str], dict[str, Shape], dict[str, Fixed]]


class _PositionDependentFriction(PortEffect):
    """Dry friction F(x)*sign(v), or viscous friction F(x)*v."""

    kind: ClassVar[LawKind] = "dry friction"
    family = "position_dependent_friction"
    needs = ("position", "velocity")
    power = "lost"
    dry: ClassVar[bool] = True

    @abstractmethod
    def level(self, at: Site) -> Level:
        """Return F(x): text, non-negative factor of each amplitude, shapes and fixed numbers."""

    def law(self, at: Site) -> Law:
        direction, speed = ("sign(v)", "tanh(v/v_c)") if self.dry else ("v", "v")
        scale = at.effort if self.dry else at.effort / at["v"].rms
        text, factors, shapes, fixed = self.level(at)
        amplitudes = {name: positive(f"{factor}{speed}", scale) for name, factor in factors.items()}
        return Law(
            f"({text})*{direction}", amplitudes, shapes | ({"v_c": creep(at)} if self.dry else {}), fixed
        )


class FrictionAlongTravel(_PositionDependentFriction):
    """Dry friction as a parabola over the travel, given by its values at both ends and a control point in the
    middle.
    """

    variant = "along_travel"
    says = "dry friction of {F_a} at the lower end and {F_b} at the upper end"

    def level(self, at: Site) -> Level:
        s = "(x - x_a)/(x_b - x_a)"
        text = f"F_a*(1 - {s})**2 + 2*F_m*{s}*(1 - {s}) + F_b*({s})**2"
        s = f"clip({s}, 0, 1)"
        factors = {"F_a": f"(1 - {s})**2*", "F_m": f"2*{s}*(1 - {s})*", "F_b": f"{s}**2*"}
        return text, factors, {}, {"x_a": Fixed("x", at["x"].low), "x_b": Fixed("x", at["x"].high)}


class ViscousFrictionAlongTravel(FrictionAlongTravel):
    """Viscous friction as a parabola over the travel, with the same three numbers as for dry friction."""

    kind = "damping"
    variant = "viscous_along_travel"
    says = "viscous friction of {F_a} at the lower end and {F_b} at the upper end"
    dry = False


class PeriodicFriction(_PositionDependentFriction):
    """Dry friction of a constant level plus a wave over position."""

    variant = "periodic"
    says = "dry friction of {F_0}, and up to {F_1} more along the position"

    def level(self, at: Site) -> Level:
        wave, grid = "0.5*(1 + cos(k_x*x - phi))", waves(at, 6)
        shapes = {
            "k_x": Shape("1/x", grid, (0.5 * grid[0], 1.5 * grid[-1])),
            "phi": Shape("1", _PHASES, (-2.0 * pi, 4.0 * pi)),
        }
        return f"F_0 + F_1*{wave}", {"F_0": "", "F_1": f"{wave}*"}, shapes, {}


class FrictionOverAnArc(_PositionDependentFriction):
    """Dry friction with an increase over part of every turn or wave: a long part for c near -1, a short one
    near 1.
    """

    variant = "arc"
    says = "dry friction of {F_0}, and up to {F_1} more over an arc"

    def level(self, at: Site) -> Level:
        wave, grid = "max((cos(k_x*x - phi) - c)/(1 - c), 0)", waves(at, 2)
        shapes = {
            "k_x": Shape("1/x", grid, (0.5 * grid[0], 1.5 * grid[-1])),
            "phi": Shape("1", _PHASES, (-2.0 * pi, 4.0 * pi)),
            "c": Shape("1", (0.1,), (-0.95, 0.95)),
        }
        return f"F_0 + F_1*{wave}", {"F_0": "", "F_1": f"{wave}*"}, shapes, {}


class TightSpot(_PositionDependentFriction):
    """Dry friction around one position."""

    variant = "tight_spot"
    says = "tight spot of {F_1} around {x_s}"

    def level(self, at: Site) -> Level:
        where, half = at["x"], at["x"].half
        shapes = {
            "x_s": Shape("x", inside(where.low, where.high, 8), (where.low, where.high)),
            "w": Shape("x", (0.1 * half, 0.3 * half), (0.01 * half, 2.0 * half)),
        }
        spot = "exp(-((x - x_s)/w)**2)"
        return f"F_1*{spot}", {"F_1": f"{spot}*"}, shapes, {}
