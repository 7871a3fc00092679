"""Drag of a turbulent fluid."""

from unmodelled.effects.effect import PortEffect
from unmodelled.effects.law import Law, positive
from unmodelled.effects.place import Site


class QuadraticDrag(PortEffect):
    """Drag proportional to the square of speed."""

    kind = "damping"
    family = "quadratic_drag"
    needs = ("velocity",)
    power = "lost"

    def law(self, at: Site) -> Law:
        return Law("c_d*v*abs(v)", {"c_d": positive("v*abs(v)", at.effort / at["v"].rms ** 2)})
