"""Different gains of an actuator for positive and negative inputs."""

from unmodelled.effects.effect import ActuatorEffect
from unmodelled.effects.law import Amplitude, Law
from unmodelled.effects.place import Site


class ActuatorAsymmetry(ActuatorEffect):
    """Gain that is higher by a share for one sign of the input and lower by this share for the other sign."""

    family = "actuator_asymmetry"
    says = "asymmetry of {g_a}, stronger at positive values"
    says_negative = "asymmetry of {g_a}, stronger at negative values"

    def law(self, at: Site) -> Law:
        return Law("u + g_a*abs(u)", {"g_a": Amplitude("abs(u)", 0.1, (-0.95, 0.95))})
