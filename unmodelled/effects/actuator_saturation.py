"""Saturation of an actuator: a largest output, also one that falls with speed, or a gain that falls."""

from collections.abc import Mapping
from typing import ClassVar

from unmodelled.effects.effect import DriveEffect
from unmodelled.effects.grids import geometric
from unmodelled.effects.known_terms import driven_port
from unmodelled.effects.law import Amplitude, Law, Shape, share
from unmodelled.effects.place import Place, Site
from unmodelled.systems.model import System

#: How many limits are tried, from this part of the largest input on.
_LIMITS, _LEAST = 6, 0.15
#: How many limits at rest and speeds are tried of a limit that falls with speed.
_EACH = 4
#: Of the gain: the most that is lost at the largest input. With half of it the output still rises there.
_LOST = 0.5


class _Saturation(DriveEffect):
    family = "actuator_saturation"
    limited: ClassVar[str]  # the limited input
    most: ClassVar[float]  # highest limit with an influence, in largest inputs
    said: ClassVar[Mapping[str, str]] = {}

    def law(self, at: Site) -> Law:
        largest = at["u"].largest
        grid = geometric(_LEAST * largest, 0.9 * self.most * largest, _LIMITS)
        shapes = {"u_max": Shape("u", grid, (0.01 * largest, self.most * largest))}
        amplitudes = {"c_u": share(f"{self.limited} - u")}
        return Law(self.limited, amplitudes, shapes, robot=self.said, phrase="saturation at ±{u_max}")


class HardSaturation(_Saturation):
    """Saturation at the same limit on both sides."""

    limited, most = "clip(u, -u_max, u_max)", 1.0
    said: ClassVar[Mapping[str, str]] = {
        "ctrl_low": "max(ctrl_low, -u_max)",
        "ctrl_high": "min(ctrl_high, u_max)",
    }


class SoftSaturation(_Saturation):
    """Saturation that approaches its limit gradually."""

    variant = "soft"
    limited, most = "u_max*tanh(u/u_max)", 4.0


class _SpeedLimit(DriveEffect):
    """Saturation whose limit falls with speed; it is tried where the input drives a port."""

    family = "actuator_saturation"
    limited: ClassVar[str]  # the limited input
    speed: ClassVar[str]  # name of the speed in it
    #: Limits at rest, in largest inputs, and speeds where the limit begins or ends, in largest speeds.
    at_rest: ClassVar[tuple[float, float]]
    speeds: ClassVar[tuple[float, float]]

    def places(self, system: System) -> tuple[Place, ...]:
        driving = {item.name for item in system.inputs if driven_port(system, item) is not None}
        return tuple(place for place in super().places(system) if place.name in driving)

    def law(self, at: Site) -> Law:
        u, v = at["u"].largest, at["v"].largest
        limits = geometric(self.at_rest[0] * u, self.at_rest[1] * u, _EACH)
        speeds = geometric(self.speeds[0] * v, self.speeds[1] * v, _EACH)
        shapes = {
            "u_0": Shape("u", limits, (0.05 * u, 20.0 * u)),
            self.speed: Shape("v", speeds, (0.1 * v, 50.0 * v)),
        }
        return Law(self.limited, {"c_u": share(f"{self.limited} - u")}, shapes)


class SpeedLimit(_SpeedLimit):
    """Saturation whose limit falls linearly with speed in the direction of motion, to zero at the speed v_0.

    It is the torque-speed curve of a DC motor: the back electromotive force takes from the supply voltage
    what drives the current (Hughes and Drury, Electric Motors and Drives, 2019, chapter 3). Against the
    direction of motion the limit is that at rest.
    """

    variant = "falling_with_speed"
    says = "limit of {u_0} at standstill, zero at {v_0}"
    limited, speed = "clip(u, -u_0*clip(1 + v/v_0, 0, 1), u_0*clip(1 - v/v_0, 0, 1))", "v_0"
    at_rest, speeds = (0.3, 2.0), (0.7, 4.0)


class PowerLimit(_SpeedLimit):
    """Saturation at a constant force up to the speed v_b, and at a constant power above, driving and braking.

    It is the range of field weakening of a vehicle's drive (Hughes and Drury, Electric Motors and Drives,
    2019).
    """

    variant = "constant_power"
    says = "limit of {u_0}, falling above {v_b}"
    limited, speed = "clip(u, -u_0*v_b/max(abs(v), v_b), u_0*v_b/max(abs(v), v_b))", "v_b"
    at_rest, speeds = (0.2, 1.0), (0.2, 0.8)


class FallingGain(DriveEffect):
    """Gain that falls in proportion to the magnitude of the input.

    A supply with an inner resistance sags under the current of its load, and the torque constant of a motor
    falls with its current as the iron saturates (Hughes and Drury, Electric Motors and Drives, 2019).
    """

    family = "actuator_saturation"
    variant = "falling_gain"

    def law(self, at: Site) -> Law:
        largest = at["u"].largest
        amplitude = Amplitude("-u*abs(u)", 0.2 / largest, (0.0, _LOST / largest))
        return Law("u - s_u*u*abs(u)", {"s_u": amplitude})
