"""Loss that is any smooth function of a level."""

from __future__ import annotations

from unmodelled.effects.balance import BalanceEffect
from unmodelled.effects.law import Fixed, Law, signed
from unmodelled.effects.place import Site


class NonlinearLoss(BalanceEffect):
    """Polynomial of order three about the middle of the levels."""

    family = "nonlinear_loss"
    complexity = 3.5

    def law(self, at: Site) -> Law:
        s = "((x - x_m)/x_r)"
        powers = {"q_0": "1", "q_1": s, "q_2": f"{s}**2", "q_3": f"{s}**3"}
        amplitudes = {name: signed(power, at.effort) for name, power in powers.items()}
        fixed = {"x_m": Fixed("x", at["x"].middle), "x_r": Fixed("x", at["x"].half)}
        return Law(f"q_0 + q_1*{s} + q_2*{s}**2 + q_3*{s}**3", amplitudes, fixed=fixed, fitted_along="x")
