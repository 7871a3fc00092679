"""Curve of an actuator: a gain that rises or falls with the magnitude of the input."""

from unmodelled.effects.effect import DriveEffect
from unmodelled.effects.law import Amplitude, Fixed, Law
from unmodelled.effects.place import Site


class ActuatorCurve(DriveEffect):
    """Gain that changes in proportion to the magnitude of the input, and is that of the file at full input.

    Of a dimensionless input up to one, such as a throttle, full input is one; of any other input it is the
    largest logged one. With f = 1 the actuator gives the square of the input, as an ideal propeller does;
    with f = -1 its output rises no more at full input. Between the two the output never falls. Autopilots of
    multicopters have f as a parameter of the motors (thrust curve).
    """

    family = "actuator_curve"

    def law(self, at: Site) -> Law:
        largest = at["u"].largest
        full = 1.0 if at.unit == "1" and largest <= 1.0 else largest
        return Law(
            "u + f*(u*abs(u)/u_r - u)",
            {"f": Amplitude("(u*abs(u)/u_r - u)", 0.2, (-1.0, 1.0))},
            fixed={"u_r": Fixed("u", full)},
            phrase="share of the square of the input {f}",
        )
