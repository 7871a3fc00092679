"""Stribeck friction: dry friction that falls with speed from breakaway to a lower level."""

from unmodelled.effects.effect import PortEffect
from unmodelled.effects.grids import creep, geometric
from unmodelled.effects.law import Law, Shape, positive
from unmodelled.effects.place import Site


class StribeckFriction(PortEffect):
    """Dry friction with a Gaussian Stribeck curve; F_b is the breakaway force minus the Coulomb level."""

    kind = "dry friction"
    family = "stribeck_friction"
    says = "dry friction of {F_c}, and {F_b} more at standstill"
    needs = ("velocity",)
    power = "lost"

    def law(self, at: Site) -> Law:
        sticking = creep(at)
        slow = 2.0 * sticking.grid[0]
        grid = geometric(slow, max(at["v"].rms, 2.0 * slow), 4)
        return Law(
            "(F_c + F_b*exp(-(v/v_s)**2))*sign(v)",
            {
                "F_c": positive("tanh(v/v_c)", at.effort),
                "F_b": positive("exp(-(v/v_s)**2)*tanh(v/v_c)", at.effort),
            },
            {"v_s": Shape("v", grid, (0.5 * grid[0], 5.0 * grid[-1])), "v_c": sticking},
            robot={"frictionloss": "frictionloss + F_c"},
        )
