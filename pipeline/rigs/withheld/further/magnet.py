"""A stage that an electromagnet pulls against a spring: the force falls with the square of the gap."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.arrays import Array
from pipeline.rigs.withheld.effects import actuators, changing, elastic, foreign, friction, loads, sensors
from pipeline.rigs.withheld.effects.effect import Plantable as P
from pipeline.rigs.withheld.machine import Conditions, Range, Sensor
from pipeline.rigs.withheld.mechanism import Mechanism


@dataclass(frozen=True)
class Magnet(Mechanism):
    """Constants of the stage; at the position 0 the spring is relaxed.

    Attributes:
        m: mass of the stage, kg.
        b: damping of the guide, N s/m.
        k_s: stiffness of the spring, N/m.
        k_m: constant of the magnet, N m^2/A^2.
        gap: gap of the magnet at the position 0, m.
        stiffness: proportional gain of the controller, A/m.
        damping: derivative gain of the controller, A s/m.
    """

    m: float = 0.8
    b: float = 6.0
    k_s: float = 1000.0
    k_m: float = 2e-5
    gap: float = 0.01
    stiffness: float = 60.0
    damping: float = 0.5

    limits = 0.0, 4.0
    ports = {"stage": (1.0,)}  # noqa: RUF012
    name = "magnet"
    input = "i"
    periods = (0.001, 0.002)
    duration = 2.0
    runs = (9, 12)
    range = Range(6e-4, 3.5, 1e-3)
    sensors = (Sensor("x", 0, False, 4e-7, 1e-6), Sensor("v", 0, True, 0.0, 2e-4))
    optional = ("v",)
    friction = {"b": "stage"}  # noqa: RUF012
    doubtful = {"m": ("inertia_error",)}  # noqa: RUF012

    def start(self, runs: int, rng: np.random.Generator) -> Array:
        return rng.uniform(9.5e-4, 1.05e-3, (1, runs))

    def held(self, reference: Array, slope: Array, c: Conditions) -> Array:
        force = np.maximum(self.k_s * reference + self.b * slope, 0.0)
        return np.asarray((self.gap - reference) * np.sqrt(force / self.k_m))

    def inertia(self, q: Array, c: Conditions) -> tuple[tuple[float, ...], ...]:
        return ((self.m,),)

    def efforts(self, q: Array, v: Array, u: Array, c: Conditions) -> tuple[Array, ...]:
        return (self.k_m * (u / (self.gap - q[0])) ** 2 - self.b * v[0] - self.k_s * q[0],)

    def load(self, name: str, u: Array) -> Array:
        return self.k_m * (u / self.gap) ** 2

    plantable = (
        P("coulomb_friction", "stage", lambda a, *_: friction.Coulomb(0.06 * a)),
        P("viscous_friction", "stage", lambda a, *_: friction.EyringDrag(4.0 * a, 0.03)),
        P("hysteresis", "stage", lambda a, *_: friction.MaxwellSlip(0.12 * a, 4e-4)),
        P("nonlinear_spring", "stage", lambda a, *_: elastic.OneSidedSpring(300.0 * a, 1e-3, 1.0, 1.7, 5e-4)),
        P("end_stop", "stage", lambda a, *_: elastic.Bumper(7e4 * a, 2.0, 2e-4, 1.4e-3)),
        P("constant_load", "stage", lambda a, *_: loads.ConstantLoad(0.12 * a)),
        P("inertia_error", "stage", lambda a, *_: loads.WrongInertia("m", 0.15 * a)),
        P("actuator_offset", "actuator:i", lambda a, *_: actuators.Offset(0.06 * a)),
        P("actuator_saturation", "actuator:i", lambda a, *_: actuators.SoftSaturation(3.0 / a)),
        P("actuator_lag", "actuator:i", lambda a, *_: actuators.TwoPoleLag(0.004 * a)),
        P("sensor_gain", "sensor:v", lambda a, *_: sensors.ScaleError(0.06 * a)),
        P("sensor_offset", "sensor:x", lambda a, *_: sensors.Bias(3e-5 * a)),
        P("drift", "stage", lambda a, plan, _: changing.WarmingBearing(5.0 * a, 8.0, plan.begin)),
        P("floor_vibration", "stage",
          lambda a, plan, rng: foreign.FloorVibration(0.15 * a, 8.0, rng.uniform(0.0, 6.28, plan.runs))),
    )  # fmt: skip
