"""Heat radiation."""

from unmodelled.effects.balance import BalanceEffect, ToKnownSurroundings
from unmodelled.effects.law import Law, Shape, positive
from unmodelled.effects.linear_loss import AROUND, SURROUNDINGS
from unmodelled.effects.place import Site


class RadiationToKnownLevel(ToKnownSurroundings):
    """Heat that a body radiates to surroundings whose temperature is known."""

    kind = "loss"
    family = "radiation"
    warm = True

    def law(self, at: Site) -> Law:
        far = max(at["x"].half, abs(at["x"].middle - at["u"].middle))
        size = at.effort / max(at["x"].rms ** 3 * far, 1e-12)
        said = f"radiation of {{k}} to {at.quantities['u'].text}"
        return Law("k*(x**4 - u**4)", {"k": positive("(x**4 - u**4)", size)}, phrase=said)


class Radiation(BalanceEffect):
    """Heat that a body radiates to its surroundings (Stefan and Boltzmann); only where the level is in K."""

    kind = "loss"
    family = "radiation"
    warm = True

    def law(self, at: Site) -> Law:
        low, high, half = at["x"].low, at["x"].high, at["x"].half
        grid = tuple(max(level, 0.0) for level in (low - 2.0 * half, low, at["x"].middle))
        shapes = {"x_a": Shape("x", tuple(dict.fromkeys(grid)), (0.0, high + 20.0 * half))}
        size = at.effort / max(at["x"].rms ** 3 * half, 1e-12)
        amplitudes = {"k": positive("(x**4 - x_a**4)", size)}
        said = "radiation of {k} to " + SURROUNDINGS
        return Law("k*(x**4 - x_a**4)", amplitudes, shapes, told=AROUND, phrase=said)
