"""Something that changes along an experiment, or from one experiment to the next."""

from __future__ import annotations

from abc import ABC

from unmodelled.effects.columns import Order
from unmodelled.effects.effect import ParameterEffect, PortEffect
from unmodelled.effects.grids import geometric
from unmodelled.effects.law import Law, Shape, signed
from unmodelled.effects.place import Place, Site
from unmodelled.systems.model import System, symbol


class DriftAlongExperiments(ParameterEffect, ABC):
    """A parameter that changes while an experiment is logged.

    Not one of a sensor: the output would show the state by another factor at every sample, and no longer tell
    where a window starts. `sensor_gain` and `sensor_offset` change sensors.
    """

    def places(self, system: System) -> tuple[Place, ...]:
        shown = set[object]().union(*(output.expression.free_symbols for output in system.outputs))
        return tuple(place for place in super().places(system) if symbol(place.name) not in shown)


class ParameterDrift(DriftAlongExperiments):
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


class ParameterDriftThatSettles(DriftAlongExperiments):
    """A parameter that goes to another value as the machine warms up, over experiments and along each.

    It warms up while an experiment is logged, and between experiments for a time that no log tells: rho, in
    time constants from the start of one experiment to that of the next.
    """

    family = "drift"
    variant = "parameter_settling"
    complexity = 3.2

    def law(self, at: Site) -> Law:
        change = f"{at.place.name}_change"
        warm = "(1 - exp(-rho*experiment_number - t/T_w))"
        return Law(
            f"p + {change}*{warm}",
            {change: signed(warm, 0.1 * at["p"].rms)},
            {
                "rho": Shape("1", (0.1, 0.5, 2.0), (0.0, 3.0)),
                "T_w": Shape("t", geometric(0.5 * at.duration, 20.0 * at.duration, 3), _times(at)),
            },
            columns={"experiment_number": Order()},
        )


def _times(at: Site) -> tuple[float, float]:
    return 0.25 * at.duration, 1e3 * at.duration


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
