"""Dry friction independent of speed."""

from unmodelled.effects.effect import PortEffect
from unmodelled.effects.grids import creep, geometric
from unmodelled.effects.law import Law, Shape, positive
from unmodelled.effects.place import Site


class CoulombFriction(PortEffect):
    """Dry friction of equal magnitude in both directions."""

    kind = "dry friction"
    family = "coulomb_friction"
    needs = ("velocity",)
    power = "lost"

    def law(self, at: Site) -> Law:
        amplitudes = {"F_c": positive("tanh(v/v_c)", at.effort)}
        said = {"frictionloss": "frictionloss + F_c"}
        return Law("F_c*sign(v)", amplitudes, {"v_c": creep(at)}, robot=said)


class GradualFriction(CoulombFriction):
    """Dry friction that rises gradually with speed, as in a contact of many asperities."""

    variant = "gradual"
    says = "dry friction of {F_c}, half of it at {v_g}"

    def law(self, at: Site) -> Law:
        speed = at["v"].rms
        shape = Shape("v", geometric(0.003 * speed, speed, 4), (1e-4 * speed, 10.0 * speed))
        rise = "atan(v/v_g)*2/pi"
        return Law(f"F_c*{rise}", {"F_c": positive(rise, at.effort)}, {"v_g": shape})


class CoulombFrictionByDirection(CoulombFriction):
    """Dry friction with another magnitude in each direction."""

    variant = "by_direction"
    says = "dry friction of {F_p} forwards and {F_n} backwards"

    def law(self, at: Site) -> Law:
        amplitudes = {
            "F_p": positive("where(v > 0, tanh(v/v_c), 0)", at.effort),
            "F_n": positive("where(v > 0, 0, tanh(v/v_c))", at.effort),
        }
        return Law("where(v > 0, F_p, -F_n)", amplitudes, {"v_c": creep(at)})
