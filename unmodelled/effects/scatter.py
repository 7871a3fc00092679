"""Scatter of a parameter between experiments (chapter 3)."""

from __future__ import annotations

from unmodelled.effects.effect import ParameterEffect
from unmodelled.effects.law import Law, signed
from unmodelled.effects.place import Site


class Scatter(ParameterEffect):
    """Deviation of a parameter that differs between experiments: one number per experiment.

    `in_columns` turns the parameter into a constant of the operating point once the numbers are known.
    """

    family = "scatter"
    complexity = 4.5

    def law(self, at: Site) -> Law:
        deviation = f"{at.place.name}_deviation"
        return Law(f"p + {deviation}", {deviation: signed("1", 0.1 * at["p"].rms)}, per_experiment=True)
