"""Friction in proportion to speed."""

from __future__ import annotations

from pipeline.physics.effects.effect import PortEffect
from pipeline.physics.effects.law import Law, positive
from pipeline.physics.effects.place import Site


class ViscousFriction(PortEffect):
    """The same in both directions."""

    family = "viscous_friction"
    complexity = 1.0
    needs = ("velocity",)
    power = "lost"

    def law(self, at: Site) -> Law:
        return Law("d*v", {"d": positive("v", at.effort / at["v"].rms)})


class ViscousFrictionByDirection(PortEffect):
    """Another coefficient for each direction."""

    family = "viscous_friction"
    variant = "by_direction"
    complexity = 2.5
    needs = ("velocity",)
    power = "lost"

    def law(self, at: Site) -> Law:
        scale = at.effort / at["v"].rms
        amplitudes = {"d_p": positive("max(v, 0)", scale), "d_n": positive("min(v, 0)", scale)}
        return Law("d_p*max(v, 0) + d_n*min(v, 0)", amplitudes)
