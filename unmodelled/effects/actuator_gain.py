"""Gain error of an actuator."""

from unmodelled.effects.effect import ActuatorEffect
from unmodelled.effects.law import Amplitude, Fixed, Law
from unmodelled.effects.place import Site


class ActuatorGain(ActuatorEffect):
    """Constant relative error of the actuator's gain, by at most a factor of two either way.

    What needs more is another law, or a wrong unit.
    """

    family = "actuator_gain"
    says = "gain off by {g}"

    def law(self, at: Site) -> Law:
        if zero := at.zero("u"):
            amplitudes = {"g": Amplitude("(u - u_z)", 0.1, (-0.5, 1.0))}
            return Law("u + g*(u - u_z)", amplitudes, fixed={"u_z": Fixed("u", zero)})
        # the limits of the file are those of what acts
        limits = {name: f"{name}/(1 + g)" for name in ("ctrl_low", "ctrl_high")}
        amplitudes = {"g": Amplitude("u", 0.1, (-0.5, 1.0))}
        return Law("(1 + g)*u", amplitudes, robot={"gain": "gain*(1 + g)", **limits})
