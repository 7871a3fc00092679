"""Gain error of an actuator."""

from __future__ import annotations

from unmodelled.effects.effect import ActuatorEffect
from unmodelled.effects.law import Amplitude, Law
from unmodelled.effects.place import Site


class ActuatorGain(ActuatorEffect):
    """Constant relative error of the actuator's gain."""

    family = "actuator_gain"
    complexity = 1.0

    def law(self, at: Site) -> Law:
        return Law("(1 + g)*u", {"g": Amplitude("u", 0.1, (-0.95, 10.0))})
