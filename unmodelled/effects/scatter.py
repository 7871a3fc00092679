"""A parameter that differs from experiment to experiment (the view of chapter 3)."""

from __future__ import annotations

from unmodelled.effects.effect import ParameterEffect
from unmodelled.effects.law import Law, signed
from unmodelled.effects.place import Site


class Scatter(ParameterEffect):
    """A deviation of its own in every experiment: its amplitude is one number per experiment.

    `in_columns` makes that number a constant of the operating point once it is known.
    """

    family = "scatter"
    complexity = 4.5

    def law(self, at: Site) -> Law:
        deviation = f"{at.place.name}_deviation"
        return Law(f"p + {deviation}", {deviation: signed("1", 0.1 * at["p"].rms)}, per_experiment=True)
