"""Exchange with a store behind a balance: the walls of a house, a second vessel, slow charge of a battery."""

from unmodelled.effects.balance import BalanceEffect
from unmodelled.effects.grids import geometric
from unmodelled.effects.law import Law, Memory, Shape, positive
from unmodelled.effects.place import Site

#: Of the longest experiment: the slowest time constant from which a fit starts, and the slowest of all.
_SLOW, _SLOWEST = 0.5, 10.0


class Storage(BalanceEffect):
    """Exchange in proportion to the difference from the level of a store, which is at rest at the start."""

    kind = "storage"
    family = "storage"
    says = "second store behind {k}, time constant {tau_n}"

    def law(self, at: Site) -> Law:
        grid = geometric(4.0 * at.period, _SLOW * at.duration, 6)
        return Law(
            "k*(x - x_n), tau_n*d(x_n)/dt = x - x_n",
            {"k": positive("(x - x_n)", at.effort / at["x"].half)},
            {"tau_n": Shape("t", grid, (at.period, _SLOWEST * at.duration))},
            memory={"x_n": Memory("x", "(x - x_n)/tau_n", start="x")},
        )
