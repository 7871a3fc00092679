"""Drift of a parameter or load, along an experiment or from one experiment to the next."""

from abc import ABC

from unmodelled.effects.columns import Order
from unmodelled.effects.effect import ParameterEffect, PortEffect
from unmodelled.effects.grids import geometric
from unmodelled.effects.law import Law, Shape, signed
from unmodelled.effects.place import Place, Site
from unmodelled.systems.model import System, symbol


class DriftAlongExperiments(ParameterEffect, ABC):
    """Parameter that changes during an experiment; parameters of sensors are excluded.

    With a sensor that changes at every sample, the initial state of a window could no longer be computed from
    the outputs. Changes of sensors are the families `sensor_gain` and `sensor_offset`.
    """

    def places(self, system: System) -> tuple[Place, ...]:
        shown = set[object]().union(*(output.expression.free_symbols for output in system.outputs))
        return tuple(place for place in super().places(system) if symbol(place.name) not in shown)


class ParameterDrift(DriftAlongExperiments):
    """Parameter that changes linearly in time along every experiment, for example by warming up."""

    family = "drift"
    variant = "parameter"

    def law(self, at: Site) -> Law:
        rate = f"{at.place.name}_rate"
        return Law(
            f"p + {rate}*t",
            {rate: signed("t", 0.1 * at["p"].rms / at.duration)},
            phrase=f"{at.place.name} drifts by {{{rate}}}",
        )


class ParameterDriftByOrder(ParameterEffect):
    """Parameter that changes by the same step from experiment to experiment, for example by wear."""

    family = "drift"
    variant = "parameter_by_order"

    def law(self, at: Site) -> Law:
        step = f"{at.place.name}_step"
        amplitude = signed("experiment_number", 0.1 * at["p"].rms)
        return Law(
            f"p + {step}*experiment_number",
            {step: amplitude},
            columns={"experiment_number": Order()},
            phrase=f"{at.place.name} changes by {{{step}}} per experiment",
        )


class ParameterDriftThatSettles(DriftAlongExperiments):
    """Parameter that approaches another value as the machine warms up, over experiments and along each of
    them.

    The machine also warms up between experiments, for an unknown time: rho is the time from the start of one
    experiment to the start of the next, in time constants.
    """

    family = "drift"
    variant = "parameter_settling"

    def law(self, at: Site) -> Law:
        change, span = f"{at.place.name}_change", at.duration
        warm = "(1 - exp(-rho*experiment_number - t/T_w))"
        return Law(
            f"p + {change}*{warm}",
            phrase=f"{at.place.name} settles by {{{change}}}",
            amplitudes={change: signed(warm, 0.1 * at["p"].rms)},
            shapes={
                "rho": Shape("1", (0.1, 0.5, 2.0), (0.0, 3.0)),
                "T_w": Shape("t", geometric(0.5 * span, 20.0 * span, 3), (0.25 * span, 1e3 * span)),
            },
            columns={"experiment_number": Order()},
        )


class LoadDrift(PortEffect):
    """Load that grows linearly in time along every experiment; laws that give a reason are simpler."""

    kind = "load"
    family = "drift"
    variant = "load"
    says = "load that drifts by {F_r}"
    domains = ("power", "balance")

    def law(self, at: Site) -> Law:
        return Law("F_r*t", {"F_r": signed("t", at.effort / at.duration)})


class LoadDriftByOrder(PortEffect):
    """Load that grows by the same step from experiment to experiment."""

    kind = "load"
    family = "drift"
    variant = "load_by_order"
    says = "load that changes by {F_n} per experiment"
    domains = ("power", "balance")

    def law(self, at: Site) -> Law:
        return Law(
            "F_n*experiment_number",
            {"F_n": signed("experiment_number", at.effort)},
            columns={"experiment_number": Order()},
        )
