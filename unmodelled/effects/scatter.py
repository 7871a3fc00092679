"""Scatter of a parameter, of the gain of an actuator, or of dry friction between experiments (chapter 3)."""

from collections.abc import Mapping

from unmodelled.effects.added import Added
from unmodelled.effects.effect import ActuatorEffect, ParameterEffect, PortEffect
from unmodelled.effects.grids import stopping
from unmodelled.effects.law import Amplitude, Fixed, Law
from unmodelled.effects.place import Site
from unmodelled.systems.units import SECOND, Dimension, parse_unit


def is_lossy(dimension: Dimension) -> bool:
    """Return whether numbers of a dimension lose power: N s/m, ohm and W/K do, kg, N/m, H and J/K do not.

    Reversing the time changes their sign, so that they hold an odd power of the second; so do pure times.
    """
    second = SECOND.index(1)
    alone = all(power == 0 for k, power in enumerate(dimension) if k != second)
    return dimension[second] % 2 == 1 and not alone


class Scatter(ParameterEffect):
    """Relative deviation of a parameter that differs between experiments: one number per experiment.

    It is at most a half: what needs more is another law. It is relative, so that its prior does not pull at
    parameters which only together are determined. `in_columns` turns the parameter into a constant of the
    operating point once the numbers are known.
    """

    family = "scatter"

    def usual(self, added: Added, period: float) -> Mapping[str, float]:
        """Losses change between experiments, with temperature and load; masses and stiffnesses do not."""
        unit = next(p.unit for p in added.system.parameters if p.name == added.place.name)
        return dict(added.priors) if is_lossy(parse_unit(unit).dimension) else {}

    def law(self, at: Site) -> Law:
        deviation = f"{at.place.name}_deviation"
        amplitude = Amplitude("p", 0.1, (-0.5, 0.5))
        return Law(f"p*(1 + {deviation})", {deviation: amplitude}, per_experiment=True)


class GainScatter(ActuatorEffect):
    """Gain of an actuator that differs between experiments, for example with the supply voltage.

    It differs by at most half. There is one number per experiment.
    """

    family = "scatter"
    variant = "gain"

    def usual(self, added: Added, period: float) -> Mapping[str, float]:
        """Supplies vary."""
        return dict(added.priors)

    def law(self, at: Site) -> Law:
        return Law("(1 + g)*u", {"g": Amplitude("u", 0.1, (-0.5, 0.5))}, per_experiment=True)


class FrictionScatter(PortEffect):
    """Dry friction that differs between experiments, for example with the temperature of a bearing.

    There is one number per experiment, the deviation from a dry friction that all experiments share.
    """

    kind = "dry friction"
    family = "scatter"
    variant = "dry_friction"
    needs = ("velocity",)
    # what all experiments have in common is no scatter
    beside = frozenset(
        {
            "coulomb_friction",
            "hysteresis",
            "load_friction",
            "position_dependent_friction",
            "stribeck_friction",
        }
    )

    def law(self, at: Site) -> Law:
        amplitude = Amplitude("tanh(v/v_c)", 0.1 * at.effort, (-at.effort, at.effort))
        fixed = {"v_c": Fixed("v", stopping(at))}
        return Law("F_d*sign(v)", {"F_d": amplitude}, fixed=fixed, per_experiment=True)
