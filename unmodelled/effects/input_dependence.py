"""Dependence on a logged input that the known physics does not use: a fan, the sun, the oil's temperature."""

from unmodelled.effects.effect import ParameterEffect, PortEffect
from unmodelled.effects.law import Fixed, Law, signed
from unmodelled.effects.place import Place, Site
from unmodelled.systems.model import System, symbol


def unused_inputs(system: System) -> tuple[str, ...]:
    """Return the inputs on which no equation of a system depends."""
    equations = [*system.closed, *(o.expression for o in system.outputs), *(s.initial for s in system.states)]
    used = set[object]().union(*(equation.free_symbols for equation in equations))
    return tuple(item.name for item in system.inputs if symbol(item.name) not in used)


class ParameterByInput(ParameterEffect):
    """Parameter that changes in proportion to an input that the known physics does not use.

    It has the value of the file where this input is nearest to zero.
    """

    family = "input_dependence"
    variant = "parameter"

    def places(self, system: System) -> tuple[Place, ...]:
        return _with_signals(system, super().places(system))

    def law(self, at: Site) -> Law:
        slope = f"{at.place.name}_per_{at.place.signal}"
        said = f"{at.place.name} changes by {{{slope}}} with {at.place.signal}"
        low, high = at["w"].low, at["w"].high
        nearest = min(max(0.0, low), high)
        size = 0.1 * at["p"].rms / max(high - low, 1e-9 * at["w"].rms)
        if nearest == 0.0:
            return Law(f"p + {slope}*w", {slope: signed("w", size)}, phrase=said)
        return Law(
            f"p + {slope}*(w - w_0)",
            {slope: signed("(w - w_0)", size)},
            fixed={"w_0": Fixed("w", nearest)},
            phrase=said,
        )


class LoadByInput(PortEffect):
    """Load in proportion to an input that the known physics does not use, a temperature in degC."""

    kind = "load"
    family = "input_dependence"
    variant = "load"
    domains = ("power", "balance")

    def places(self, system: System) -> tuple[Place, ...]:
        return _with_signals(system, super().places(system))

    def law(self, at: Site) -> Law:
        slope = f"{at.place.name}_per_{at.place.signal}"
        said = f"load that changes by {{{slope}}} with {at.place.signal}"
        if not (zero := at.zero("w")):
            return Law(f"{slope}*w", {slope: signed("w", at.effort / at["w"].rms)}, phrase=said)
        size = at.effort / max(abs(at["w"].low - zero), abs(at["w"].high - zero), 1.0)
        return Law(
            f"{slope}*(w - w_0)",
            {slope: signed("(w - w_0)", size)},
            fixed={"w_0": Fixed("w", zero)},
            phrase=said,
        )


def _with_signals(system: System, places: tuple[Place, ...]) -> tuple[Place, ...]:
    names = unused_inputs(system)
    return tuple(Place(place.kind, place.name, signal=name) for place in places for name in names)
