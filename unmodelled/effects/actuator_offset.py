"""Offset of an actuator."""

from unmodelled.effects.effect import ActuatorEffect
from unmodelled.effects.law import Law, signed
from unmodelled.effects.place import Site


class ActuatorOffset(ActuatorEffect):
    """Constant added to the input."""

    family = "actuator_offset"
    says = "offset of {u_0}"

    def law(self, at: Site) -> Law:
        # the limits of the file are those of what acts
        limits = {name: f"{name} - u_0" for name in ("ctrl_low", "ctrl_high")}
        amplitudes = {"u_0": signed("1", 0.1 * at["u"].rms)}
        return Law("u + u_0", amplitudes, robot={"bias": "bias + gain*u_0", **limits})
