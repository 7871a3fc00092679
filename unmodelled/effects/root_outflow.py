"""Outflow through an opening: its speed grows with the square root of the level (Torricelli)."""

from unmodelled.effects.balance import BalanceEffect
from unmodelled.effects.law import Fixed, Law, positive
from unmodelled.effects.place import Site

#: Of the rms level: below this level the outflow is in proportion to it, so that its slope is finite.
_SHALLOW = 1e-3


class RootOutflow(BalanceEffect):
    """Turbulent outflow in proportion to the square root of the level."""

    kind = "loss"
    family = "root_outflow"
    warm = False

    def law(self, at: Site) -> Law:
        size = at["x"].rms
        adds = "max(x, 0)/sqrt(max(x, x_s))"
        fixed = {"x_s": Fixed("x", _SHALLOW * size)}
        return Law("k*sqrt(x)", {"k": positive(adds, at.effort / size**0.5)}, fixed=fixed)
