"""Offset of an actuator."""

from __future__ import annotations

from unmodelled.effects.effect import ActuatorEffect
from unmodelled.effects.law import Law, signed
from unmodelled.effects.place import Site


class ActuatorOffset(ActuatorEffect):
    """Constant added to the input."""

    family = "actuator_offset"
    complexity = 1.0

    def law(self, at: Site) -> Law:
        return Law("u + u_0", {"u_0": signed("1", 0.1 * at["u"].rms)})
