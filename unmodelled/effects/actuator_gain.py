"""An actuator that gives more or less than its input says."""

from __future__ import annotations

from unmodelled.effects.effect import ActuatorEffect
from unmodelled.effects.law import Amplitude, Law
from unmodelled.effects.place import Site


class ActuatorGain(ActuatorEffect):
    """The same share everywhere."""

    family = "actuator_gain"
    complexity = 1.0

    def law(self, at: Site) -> Law:
        return Law("(1 + g)*u", {"g": Amplitude("u", 0.1, (-0.95, 10.0))})
