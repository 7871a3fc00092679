"""A servo: a direct-current motor with inductance turns a disc, with position control."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.arrays import Array
from pipeline.rigs.withheld.effects import actuators, changing, flows, foreign, friction, loads, play, sensors
from pipeline.rigs.withheld.effects.effect import Plantable as P
from pipeline.rigs.withheld.machine import Conditions, Range, Sensor
from pipeline.rigs.withheld.mechanism import Mechanism


@dataclass(frozen=True)
class RotaryServo(Mechanism):
    """Constants of the servo.

    Attributes:
        J: moment of inertia of rotor and disc, kg m^2.
        b: damping of the bearings, N m s/rad.
        kt: torque constant and back-EMF constant, N m/A.
        R: resistance of the winding, ohm.
        L: inductance of the winding, H.
        stiffness: proportional gain of the controller, V/rad.
        damping: derivative gain of the controller, V s/rad.
    """

    J: float = 4e-4
    b: float = 4e-4
    kt: float = 0.08
    R: float = 2.0
    L: float = 8e-3
    stiffness: float = 9.0
    damping: float = 0.3

    limits = -24.0, 24.0
    levels = 1
    ports = {"shaft": (1.0, 0.0), "coil": (0.0, 1.0)}  # noqa: RUF012
    name = "rotary_servo"
    input = "u"
    periods = (0.001, 0.002)
    duration = 3.0
    runs = (8, 10)
    range = Range(2.0, 1.8)
    sensors = (
        Sensor("theta", 0, False, 2.0 * np.pi / 8192, 4e-4),
        Sensor("omega", 0, True, 0.0, 0.12),
        Sensor("i", 1, False, 2e-3, 5e-3),
    )
    optional = ("omega",)
    friction = {"b": "shaft"}  # noqa: RUF012
    doubtful = {"J": ("inertia_error",), "R": ("self_heating",)}  # noqa: RUF012

    def start(self, runs: int, rng: np.random.Generator) -> Array:
        return np.stack([rng.uniform(-0.05, 0.05, runs), np.zeros(runs)])

    def held(self, reference: Array, slope: Array, c: Conditions) -> Array:
        return (self.kt + self.R * self.b / self.kt) * slope

    def inertia(self, q: Array, c: Conditions) -> tuple[tuple[float, ...], ...]:
        return (self.J, 0.0), (0.0, self.L)

    def efforts(self, q: Array, v: Array, u: Array, c: Conditions) -> tuple[Array, ...]:
        return self.kt * q[1] - self.b * v[0], u - self.R * q[1] - self.kt * v[0]

    plantable = (
        P("coulomb_friction", "shaft", lambda a, *_: friction.Coulomb(0.01 * a)),
        P("stribeck_friction", "shaft", lambda a, *_: friction.LorentzFriction(0.006 * a, 0.018 * a, 1.5)),
        P("quadratic_drag", "shaft", lambda a, *_: friction.Windage(1e-4 * a, 2.0)),
        P("torque_ripple", "shaft",
          lambda a, *_: loads.Ripple([0.012 * a, 0.005 * a], [7.0, 14.0], [0.3, 1.7])),
        P("inertia_error", "shaft", lambda a, *_: loads.WrongInertia("J", 1e-4 * a)),
        P("backlash", "shaft", lambda a, *_: play.LooseInertia("J", 8e-5, 0.05 * a, 0.2, 0.2)),
        P("self_heating", "coil", lambda a, *_: flows.HotCopper(2.0, 0.15 * a, 0.6, 6.0)),
        P("actuator_saturation", "actuator:u", lambda a, *_: actuators.SoftSaturation(8.0 / a)),
        P("actuator_dead_zone", "actuator:u", lambda a, *_: actuators.RoundedDeadZone(0.5 * a)),
        P("input_delay", "actuator:u", lambda a, *_: actuators.Transport(0.005 * a)),
        P("sensor_gain", "sensor:i", lambda a, *_: sensors.ScaleError(0.06 * a)),
        P("sensor_delay", "sensor:omega", lambda a, *_: sensors.Latency(0.006 * a)),
        P("drift", "shaft", lambda a, plan, _: changing.WarmingBearing(1.2e-3 * a, 12.0, plan.begin)),
        P("missed_counts", "sensor:theta", lambda a, *_: foreign.MissedCounts(0.06 * a, 12.0)),
        P("heated_motor", "actuator:u", lambda a, *_: foreign.HeatedMotor(0.02 * a, 0.6),
          (("drift", "actuator:u"), ("actuator_gain", "actuator:u"))),
    )  # fmt: skip
