"""Viscous friction."""

from unmodelled.effects.effect import PortEffect
from unmodelled.effects.grids import geometric
from unmodelled.effects.law import Law, Shape, positive
from unmodelled.effects.place import Site


class ViscousFriction(PortEffect):
    """Friction proportional to speed, equal in both directions."""

    kind = "damping"
    family = "viscous_friction"
    needs = ("velocity",)
    power = "lost"

    def law(self, at: Site) -> Law:
        amplitudes = {"d": positive("v", at.effort / at["v"].rms)}
        return Law("d*v", amplitudes, robot={"damping": "damping + d"})


class ShearThinning(ViscousFriction):
    """Eyring friction: proportional to speed at first, less than that above the speed v_e, as in thin oil
    films.
    """

    variant = "shear_thinning"
    says = "viscous friction of {d}, less above {v_e}"

    def law(self, at: Site) -> Law:
        speed = at["v"].rms
        # the inverse hyperbolic sine
        thinned = "v_e*log(v/v_e + sqrt((v/v_e)**2 + 1))"
        shape = Shape("v", geometric(0.05 * speed, 2.0 * speed, 4), (1e-3 * speed, 20.0 * speed))
        return Law(f"d*{thinned}", {"d": positive(thinned, at.effort / speed)}, {"v_e": shape})


class ViscousFrictionByDirection(ViscousFriction):
    """Friction proportional to speed, with another coefficient in each direction."""

    variant = "by_direction"
    says = "viscous friction of {d_p} forwards and {d_n} backwards"

    def law(self, at: Site) -> Law:
        scale = at.effort / at["v"].rms
        amplitudes = {"d_p": positive("max(v, 0)", scale), "d_n": positive("min(v, 0)", scale)}
        return Law("d_p*max(v, 0) + d_n*min(v, 0)", amplitudes)
