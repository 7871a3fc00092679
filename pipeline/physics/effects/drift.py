"""Something that changes along an experiment, or from one experiment to the next."""

from __future__ import annotations

from pipeline.physics.effects.columns import Order
from pipeline.physics.effects.effect import ParameterEffect, PortEffect
from pipeline.physics.effects.law import Law, signed
from pipeline.physics.effects.place import Site


class ParameterDrift(ParameterEffect):
    """A parameter that changes evenly along every experiment, as when something warms up."""

    family = "drift"
    variant = "parameter"
    complexity = 2.0

    def law(self, at: Site) -> Law:
        rate = f"{at.place.name}_rate"
        return Law(f"p + {rate}*t", {rate: signed("t", 0.1 * at["p"].rms / at.duration)})


class ParameterDriftByOrder(ParameterEffect):
    """A parameter that changes evenly from experiment to experiment, as when something wears."""

    family = "drift"
    variant = "parameter_by_order"
    complexity = 2.2

    def law(self, at: Site) -> Law:
        step = f"{at.place.name}_step"
        amplitude = signed("experiment_number", 0.1 * at["p"].rms)
        return Law(f"p + {step}*experiment_number", {step: amplitude}, columns={"experiment_number": Order()})


class LoadDrift(PortEffect):
    """A load that grows evenly along every experiment."""

    family = "drift"
    variant = "load"
    complexity = 2.4

    def law(self, at: Site) -> Law:
        return Law("F_r*t", {"F_r": signed("t", at.effort / at.duration)})


class LoadDriftByOrder(PortEffect):
    """A load that grows evenly from experiment to experiment."""

    family = "drift"
    variant = "load_by_order"
    complexity = 2.6

    def law(self, at: Site) -> Law:
        return Law(
            "F_n*experiment_number",
            {"F_n": signed("experiment_number", at.effort)},
            columns={"experiment_number": Order()},
        )
