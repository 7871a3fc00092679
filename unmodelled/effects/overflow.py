"""Overflow: what leaves above a level."""

from unmodelled.effects.balance import BalanceEffect
from unmodelled.effects.grids import inside
from unmodelled.effects.law import Law, Shape, Told, positive
from unmodelled.effects.place import Site


class Overflow(BalanceEffect):
    """Flow in proportion to the level above a threshold, as through a valve that opens."""

    kind = "loss"
    family = "overflow"
    says = "overflow above {x_o}"
    warm = False
    #: Exponent of the level above the threshold.
    exponent = 1.0

    def law(self, at: Site) -> Law:
        low, high, half = at["x"].low, at["x"].high, at["x"].half
        adds = "max(x - x_o, 0)" if self.exponent == 1.0 else f"max(x - x_o, 0)**{self.exponent:g}"
        shapes = {"x_o": Shape("x", inside(low, high, 6), (low - half, high))}
        amplitudes = {"k": positive(adds, at.effort / half**self.exponent)}
        return Law(f"k*{adds}", amplitudes, shapes, told={"x_o": Told("level of the edge", level=True)})


class Weir(Overflow):
    """Flow over the edge of a vessel: it grows with the power 1.5 of the level above the edge (Poleni)."""

    variant = "weir"
    exponent = 1.5
