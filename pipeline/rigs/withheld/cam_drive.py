"""A direct-current motor that turns a grooved cam, with a follower that moves vertically on a spring."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.arrays import Array
from pipeline.rigs.withheld.effects import (
    actuators,
    changing,
    elastic,
    foreign,
    friction,
    loads,
    play,
    sensors,
)
from pipeline.rigs.withheld.effects.effect import Plantable as P
from pipeline.rigs.withheld.effects.effect import Port
from pipeline.rigs.withheld.machine import Conditions, Machine, Range, Sensor

_GRAVITY = 9.81
_COUNT = 2.0 * np.pi / 10_000


@dataclass(frozen=True)
class CamDrive(Machine):
    """Constants of the cam drive.

    The groove lifts the follower by `lift` with a share `skew` of second harmonic. The operating point is the
    mass m of the follower (kg) and the supply V (V). The motor gets the share `duty` of the supply.

    Attributes:
        J: inertia of the shaft, kg m^2.
        b: damping of the shaft, N m s/rad.
        kt: torque constant of the motor, N m/A.
        R: resistance of the motor, ohm.
        m_0: mass of the follower in addition to m, kg.
        k_s: stiffness of the spring, N/m.
        y_0: compression of the spring at the lowest position, m.
        lift: amplitude of the groove, m.
        skew: share of the second harmonic in the groove.
        gain: gain of the controller of the speed, s/rad.
        fastest: set point of the speed at the reference 1, rad/s.
    """

    J: float = 0.004
    b: float = 0.01
    kt: float = 0.26
    R: float = 0.95
    m_0: float = 0.35
    k_s: float = 150.0
    y_0: float = 0.04
    lift: float = 0.04
    skew: float = 0.15
    gain: float = 0.03
    fastest: float = 25.0

    name = "cam_drive"
    input = "duty"
    periods = (5e-4, 0.001)
    duration = 2.0
    runs = (12, 16)
    range = Range(0.75, 2.0)
    sensors = (Sensor("theta", 0, False, _COUNT, 1.5e-3), Sensor("omega", 0, True, 0.0, 0.08))
    optional = ("omega",)
    factors = {"m": (0.4, 0.9, 1.5), "V": (9.0, 13.0)}  # noqa: RUF012
    friction = {"b": "shaft"}  # noqa: RUF012
    doubtful = {"m_0": ("inertia_error",), "k_s": ("linear_spring", "nonlinear_spring")}  # noqa: RUF012

    def start(self, runs: int, rng: np.random.Generator) -> Array:
        return rng.uniform(-0.5, 0.5, (1, runs))

    def command(self, reference: Array, slope: Array, q: Array, v: Array, c: Conditions) -> Array:
        return reference

    def regulated(self, reference: Array, slope: Array, q: Array, v: Array, c: Conditions) -> Array:
        speed = self.fastest * reference
        u = self.kt * speed / c["V"] + self.gain * (speed - v[0])
        return np.asarray(np.clip(u, -1.0, 1.0))

    def groove(self, theta: Array) -> tuple[Array, Array, Array]:
        """Return the height of the follower, and its first and second derivative by the angle.

        Takes theta (n,) in rad; gives (n,).
        """
        wave = np.exp(1j * theta)
        second = self.skew * wave * wave
        half = 0.5 * self.lift
        return (
            half * (1.0 - wave + second - self.skew).real,
            half * (wave - 2.0 * second).imag,
            (half * (wave - 4.0 * second).real),
        )

    def _inertia(self, slope: Array, c: Conditions) -> Array:
        return np.asarray(self.J + (c["m"] + self.m_0) * slope**2)

    def rates(self, q: Array, v: Array, u: Array, c: Conditions) -> Array:
        y, slope, bend = self.groove(q[0])
        mass, omega = c["m"] + self.m_0, v[0]
        current = (u * c["V"] - self.kt * omega) / self.R
        force = mass * (_GRAVITY + bend * omega**2) + self.k_s * (y + self.y_0)
        torque = self.kt * current - self.b * omega - slope * force
        return np.asarray(torque / self._inertia(slope, c))[None]

    def port(self, name: str, q: Array, v: Array, c: Conditions) -> Port:
        y, slope, _ = self.groove(q[0])
        mobility = 1.0 / self._inertia(slope, c)
        if name == "shaft":
            return Port(q[0], v[0], -mobility[None], mobility)
        return Port(y, slope * v[0], -(slope * mobility)[None], slope * slope * mobility)

    plantable = (
        P("viscous_friction", "follower", lambda a, *_: friction.EyringDrag(25.0 * a, 1.0), local=True),
        P("coulomb_friction", "follower", lambda a, *_: friction.Coulomb(4.0 * a), local=True),
        P("coulomb_friction", "shaft", lambda a, *_: friction.Coulomb(0.1 * a), local=True),
        P("stribeck_friction", "shaft", lambda a, *_: friction.TustinFriction(0.06 * a, 0.2 * a, 2.0)),
        P("quadratic_drag", "shaft", lambda a, *_: friction.Windage(4e-4 * a, 2.0), local=True),
        P("position_dependent_friction", "shaft", lambda a, *_: friction.RubbingArc(0.2 * a, 2.0)),
        P("hysteresis", "follower", lambda a, *_: friction.MaxwellSlip(8.0 * a, 0.012)),
        P("linear_spring", "follower", lambda a, *_: elastic.RubberSpring(250.0 * a, 0.0, 0.2), local=True),
        P("nonlinear_spring", "follower",
          lambda a, *_: elastic.OneSidedSpring(700.0 * a, 0.015, 1.0, 1.7, 0.02)),
        P("end_stop", "follower", lambda a, *_: elastic.Bumper(3e4 * a, 0.4, -1.0, 0.032)),
        P("constant_load", "follower",
          lambda a, *_: loads.ConstantLoad(4.0 * a), (("gravity_load", "follower"),)),
        P("gravity_load", "shaft", lambda a, *_: loads.Unbalance(0.12 * a, 0.8)),
        P("torque_ripple", "shaft", lambda a, *_: loads.Ripple([0.15 * a, 0.1 * a], [8.0, 24.0], [0.2, 1.4])),
        P("backlash", "shaft", lambda a, *_: play.LooseInertia("J", 0.002, 0.08 * a, 0.2, 0.5)),
        P("inertia_error", "follower", lambda a, *_: loads.WrongInertia("m_0", 0.5 * a)),
        P("actuator_gain", "actuator:duty", lambda a, *_: actuators.Gain(0.12 * a)),
        P("actuator_offset", "actuator:duty", lambda a, *_: actuators.Offset(0.04 * a)),
        P("actuator_saturation", "actuator:duty", lambda a, *_: actuators.SoftSaturation(0.8 / a)),
        P("actuator_dead_zone", "actuator:duty", lambda a, *_: actuators.RoundedDeadZone(0.06 * a)),
        P("actuator_lag", "actuator:duty", lambda a, *_: actuators.TwoPoleLag(0.016 * a)),
        P("actuator_rate_limit", "actuator:duty", lambda a, *_: actuators.SlowAmplifier(2.0 / a)),
        P("input_delay", "actuator:duty", lambda a, *_: actuators.Transport(0.0103 * a)),
        P("sensor_offset", "sensor:theta", lambda a, *_: sensors.Bias(0.1 * a)),
        P("sensor_gain", "sensor:omega", lambda a, *_: sensors.ScaleError(0.08 * a)),
        P("sensor_delay", "sensor:omega", lambda a, *_: sensors.Latency(0.0075 * a)),
        P("sensor_lag", "sensor:omega", lambda a, *_: sensors.LowPass(0.025 * a)),
        P("drift", "shaft", lambda a, plan, _: changing.WarmingBearing(0.012 * a, 12.0, plan.begin)),
        P("scatter", "shaft",
          lambda a, plan, rng: changing.scattered_damping(0.006 * a, -0.009, plan.runs, rng)),
        P("centrifugal", "shaft", lambda a, *_: foreign.Centrifugal(8e-4 * a, 5.0, 0.7)),
        P("heated_friction", "follower",
          lambda a, plan, _: foreign.HeatedFriction((2.0 + 5.0 * plan.conditions["m"]) * a, 3.0, 3.0),
          (("coulomb_friction", "follower"), ("drift", "follower"))),
        P("sticky_valve", "actuator:duty", lambda a, *_: foreign.StickyValve(0.06 * a)),
        P("heated_motor", "actuator:duty", lambda a, *_: foreign.HeatedMotor(0.5 * a, 0.5),
          (("drift", "actuator:duty"), ("actuator_gain", "actuator:duty"))),
    )  # fmt: skip
