"""Parameter that has another value at one level of a factor: a load at the flange, an oil, a repair."""

from unmodelled.effects.effect import ParameterEffect
from unmodelled.effects.law import Law, signed
from unmodelled.effects.place import Site


class ParameterChange(ParameterEffect):
    """Parameter that has another value in the experiments of one level, by a number that they share."""

    family = "parameter_change"
    at_levels = True

    def law(self, at: Site) -> Law:
        change = f"{at.place.name}_change"
        return Law(
            f"p + {change}",
            {change: signed("1", 0.1 * at["p"].rms)},
            phrase=f"{at.place.name} changes by {{{change}}}",
        )
