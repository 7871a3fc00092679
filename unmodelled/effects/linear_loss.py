"""Loss in proportion to a level: heat through a wall, a leak, a leakage current."""

from unmodelled.effects.balance import BalanceEffect, ToKnownSurroundings
from unmodelled.effects.law import Law, Shape, Told, positive
from unmodelled.effects.place import Site

#: Level of surroundings that no input shows, as a person reads it on the scale of the sensor.
AROUND = {"x_a": Told("level of the surroundings", level=True)}
SURROUNDINGS = "surroundings at {x_a}"


class LinearLoss(BalanceEffect):
    """Loss in proportion to the level; no body loses heat towards 0 K."""

    kind = "loss"
    family = "linear_loss"
    warm = False

    def law(self, at: Site) -> Law:
        return Law("k*x", {"k": positive("x", at.effort / at["x"].rms)})


class LossToKnownLevel(ToKnownSurroundings):
    """Exchange in proportion to the difference from a known level, such as the ambient temperature."""

    kind = "loss"
    family = "linear_loss"

    def law(self, at: Site) -> Law:
        far = max(at["x"].half, abs(at["x"].middle - at["u"].middle))
        said = f"loss of {{k}} to {at.quantities['u'].text}"
        return Law("k*(x - u)", {"k": positive("(x - u)", at.effort / far)}, phrase=said)


class LossToSurroundings(BalanceEffect):
    """Exchange in proportion to the difference from the level of the surroundings."""

    kind = "loss"
    family = "linear_loss"
    variant = "to_surroundings"

    def law(self, at: Site) -> Law:
        low, high, half = at["x"].low, at["x"].high, at["x"].half
        grid = (low - 2.0 * half, low, at["x"].middle, high)
        amplitudes = {"k": positive("(x - x_a)", at.effort / half)}
        shapes = {"x_a": Shape("x", grid, (low - 20.0 * half, high + 20.0 * half))}
        return Law("k*(x - x_a)", amplitudes, shapes, told=AROUND, phrase="loss of {k} to " + SURROUNDINGS)
