"""Friction that changes with the time of running."""

from unmodelled.effects.effect import PortEffect
from unmodelled.effects.grids import stopping
from unmodelled.effects.law import Fixed, Law, signed
from unmodelled.effects.place import Site


class DryFrictionDrift(PortEffect):
    """Dry friction that changes linearly in time along every experiment, beside a dry friction that does not.

    Friction of a robot joint falls as its lubricant warms up (Bittencourt and Gunnarsson, Journal of Dynamic
    Systems, Measurement, and Control 134, 2012).
    """

    kind = "dry friction"
    family = "drift"
    variant = "dry_friction"
    says = "dry friction that drifts by {F_t}"
    needs = ("velocity",)
    beside = frozenset({"coulomb_friction", "hysteresis", "load_friction", "stribeck_friction"})

    def law(self, at: Site) -> Law:
        amplitudes = {"F_t": signed("t*tanh(v/v_c)", at.effort / at.duration)}
        return Law("F_t*t*sign(v)", amplitudes, fixed={"v_c": Fixed("v", stopping(at))})


class ViscousFrictionDrift(PortEffect):
    """Viscous friction that changes linearly in time along every experiment, beside one that does not."""

    kind = "damping"
    family = "drift"
    variant = "viscous_friction"
    says = "viscous friction that drifts by {d_t}"
    needs = ("velocity",)
    beside = frozenset({"viscous_friction", "stribeck_friction"})

    def law(self, at: Site) -> Law:
        return Law("d_t*t*v", {"d_t": signed("t*v", at.effort / (at["v"].rms * at.duration))})
