"""Loss that is any smooth function of a level."""

from unmodelled.effects.balance import BalanceEffect
from unmodelled.effects.grids import polynomial
from unmodelled.effects.law import Law
from unmodelled.effects.place import Site


class NonlinearLoss(BalanceEffect):
    """Polynomial of order three about the middle of the levels."""

    kind = "loss"
    family = "nonlinear_loss"
    says = "loss that changes by {q_1} over half of the range"
    says_negative = "loss that falls by {q_1} over half of the range"

    def law(self, at: Site) -> Law:
        return polynomial(at, "q", 3)
