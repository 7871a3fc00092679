"""A hoist with position control: a drum lifts a payload against gravity."""

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


@dataclass(frozen=True)
class Hoist(Machine):
    """Constants of the hoist, reduced to the rope; the payload m (kg) is the operating point.

    Attributes:
        M: mass of drum and balanced cabin, kg.
        kf: force constant of the drive, N/V.
        b: damping, N s/m.
        stiffness: proportional gain of the controller, V/m.
        damping: derivative gain of the controller, V s/m.
        supply: largest voltage of the controller, V.
    """

    M: float = 8.5
    kf: float = 12.0
    b: float = 31.0
    stiffness: float = 160.0
    damping: float = 18.0
    supply: float = 12.0

    name = "hoist"
    input = "u"
    periods = (0.001, 0.002)
    duration = 3.0
    runs = (9, 12)
    range = Range(0.16, 1.6, 0.5)
    sensors = (Sensor("x", 0, False, 5e-5, 1e-4), Sensor("v", 0, True, 0.0, 0.004))
    optional = ("v",)
    factors = {"m": (0.5, 1.5, 3.0)}  # noqa: RUF012
    friction = {"b": "rail"}  # noqa: RUF012
    doubtful = {"M": ("inertia_error",)}  # noqa: RUF012

    def start(self, runs: int, rng: np.random.Generator) -> Array:
        return rng.uniform(0.495, 0.505, (1, runs))

    def command(self, reference: Array, slope: Array, q: Array, v: Array, c: Conditions) -> Array:
        hold = (c["m"] * _GRAVITY + self.b * slope) / self.kf
        u = hold + self.stiffness * (reference - q[0]) + self.damping * (slope - v[0])
        return np.asarray(np.clip(u, -self.supply, self.supply))

    def rates(self, q: Array, v: Array, u: Array, c: Conditions) -> Array:
        return (self.kf * u - self.b * v - c["m"] * _GRAVITY) / (self.M + c["m"])

    def port(self, name: str, q: Array, v: Array, c: Conditions) -> Port:
        mobility = 1.0 / (self.M + c["m"])
        return Port(q[0], v[0], -mobility[None], mobility)

    def load(self, name: str, u: Array) -> Array:
        return np.asarray(self.kf * u)

    plantable = (
        P("coulomb_friction", "rail", lambda a, *_: friction.Coulomb(5.0 * a), local=True),
        P("stribeck_friction", "rail",
          lambda a, *_: friction.LorentzFriction(3.0 * a, 9.0 * a, 0.05), local=True),
        P("load_friction", "rail", lambda a, *_: friction.GearFriction(min(0.12 * a, 0.4), 4.0), local=True),
        P("quadratic_drag", "rail", lambda a, *_: friction.Windage(20.0 * a, 0.05), local=True),
        P("position_dependent_friction", "rail",
          lambda a, *_: friction.TightSpot(14.0 * a, 0.52, 0.04), local=True),
        P("hysteresis", "rail", lambda a, *_: friction.MaxwellSlip(6.0 * a, 0.02)),
        P("linear_spring", "rail", lambda a, *_: elastic.RubberSpring(40.0 * a, 0.5, 0.5)),
        P("nonlinear_spring", "rail",
          lambda a, *_: elastic.PlaySpring(60.0 * a, 4e3 * a, 0.5, 0.03), local=True),
        P("end_stop", "rail", lambda a, *_: elastic.Bumper(2e4 * a, 0.5, 0.4, 0.6)),
        P("constant_load", "rail", lambda a, *_: loads.ConstantLoad(6.0 * a),
          (("actuator_offset", "actuator:u"), ("gravity_load", "rail")), local=True),
        P("torque_ripple", "rail",
          lambda a, *_: loads.Ripple([5.0 * a, 2.0 * a, 1.0 * a], [60.0, 120.0, 180.0],
          [0.3, 1.1, 2.6])),
        P("backlash", "rail", lambda a, *_: play.LooseInertia("M", 2.5, 0.003 * a, 0.25, 0.02)),
        P("inertia_error", "rail", lambda a, *_: loads.WrongInertia("M", 1.8 * a)),
        P("actuator_offset", "actuator:u", lambda a, *_: actuators.Offset(0.5 * a),
          (("constant_load", "rail"), ("gravity_load", "rail"))),
        P("actuator_saturation", "actuator:u", lambda a, *_: actuators.SoftSaturation(11.0 / a)),
        P("actuator_dead_zone", "actuator:u", lambda a, *_: actuators.RoundedDeadZone(0.6 * a)),
        P("actuator_lag", "actuator:u", lambda a, *_: actuators.TwoPoleLag(0.008 * a)),
        P("input_delay", "actuator:u", lambda a, *_: actuators.Transport(0.0073 * a)),
        P("sensor_gain", "sensor:v", lambda a, *_: sensors.ScaleError(0.08 * a)),
        P("sensor_offset", "sensor:v", lambda a, *_: sensors.Bias(0.025 * a)),
        P("sensor_delay", "sensor:v", lambda a, *_: sensors.Latency(0.006 * a)),
        P("sensor_lag", "sensor:v", lambda a, *_: sensors.LowPass(0.02 * a)),
        P("drift", "actuator:u",
          lambda a, plan, _: changing.FadingDrive(min(0.2 * a, 0.6), 15.0, plan.begin)),
        P("scatter", "rail",
          lambda a, plan, rng: changing.scattered_damping(14.0 * a, -25.0, plan.runs, rng)),
        P("heated_friction", "rail",
          lambda a, plan, _: foreign.HeatedFriction((2.0 + 4.0 * plan.conditions["m"]) * a, 2.0, 3.0),
          (("coulomb_friction", "rail"), ("drift", "rail"))),
        P("floor_vibration", "rail",
          lambda a, plan, rng: foreign.FloorVibration(7.0 * a, 10.0, rng.uniform(0.0, 6.28, plan.runs))),
        P("sticky_valve", "actuator:u", lambda a, *_: foreign.StickyValve(0.8 * a)),
        P("flexible_transmission", "rail", lambda a, *_: play.Resonator("M", min(1.8 * a, 6.0), 8.0, 0.02)),
    )  # fmt: skip
