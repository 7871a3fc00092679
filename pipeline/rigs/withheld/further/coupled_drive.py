"""A drive with two inertias: a motor turns a load through a flexible coupling."""

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
from pipeline.rigs.withheld.machine import Conditions, Range, Sensor
from pipeline.rigs.withheld.mechanism import Mechanism


@dataclass(frozen=True)
class CoupledDrive(Mechanism):
    """Constants of the drive.

    Attributes:
        J1: moment of inertia of the motor, kg m^2.
        J2: moment of inertia of the load, kg m^2.
        k: stiffness of the coupling, N m/rad.
        d: damping of the coupling, N m s/rad.
        b1: damping of the motor, N m s/rad.
        b2: damping of the load, N m s/rad.
        stiffness: proportional gain of the controller, N m/rad.
        damping: derivative gain of the controller, N m s/rad.
    """

    J1: float = 0.002
    J2: float = 0.006
    k: float = 30.0
    d: float = 0.03
    b1: float = 0.01
    b2: float = 0.02
    stiffness: float = 2.0
    damping: float = 0.12

    limits = -4.0, 4.0
    ports = {"motor": (1.0, 0.0), "load": (0.0, 1.0), "coupling": (1.0, -1.0)}  # noqa: RUF012
    name = "coupled_drive"
    input = "T"
    periods = (0.001, 0.002)
    duration = 3.0
    runs = (8, 10)
    range = Range(1.2, 2.0)
    sensors = (
        Sensor("q1", 0, False, 2.0 * np.pi / 16384, 2e-4),
        Sensor("q2", 1, False, 2.0 * np.pi / 16384, 2e-4),
        Sensor("w1", 0, True, 0.0, 0.05),
        Sensor("w2", 1, True, 0.0, 0.05),
    )
    optional = ("w2",)
    friction = {"b1": "motor", "b2": "load"}  # noqa: RUF012
    doubtful = {"J2": ("inertia_error",)}  # noqa: RUF012

    def start(self, runs: int, rng: np.random.Generator) -> Array:
        return np.tile(rng.uniform(-0.05, 0.05, runs), (2, 1))

    def held(self, reference: Array, slope: Array, c: Conditions) -> Array:
        return (self.b1 + self.b2) * slope

    def inertia(self, q: Array, c: Conditions) -> tuple[tuple[float, ...], ...]:
        return (self.J1, 0.0), (0.0, self.J2)

    def efforts(self, q: Array, v: Array, u: Array, c: Conditions) -> tuple[Array, ...]:
        passed = self.k * (q[0] - q[1]) + self.d * (v[0] - v[1])
        return u - self.b1 * v[0] - passed, passed - self.b2 * v[1]

    def load(self, name: str, u: Array) -> Array:
        return np.asarray(u if name == "motor" else 0.0 * u)

    plantable = (
        P("coulomb_friction", "load", lambda a, *_: friction.Coulomb(0.1 * a)),
        P("stribeck_friction", "motor", lambda a, *_: friction.TustinFriction(0.06 * a, 0.15 * a, 0.6)),
        P("load_friction", "motor", lambda a, *_: friction.GearFriction(min(0.15 * a, 0.5), 0.02)),
        P("hysteresis", "coupling", lambda a, *_: friction.MaxwellSlip(0.15 * a, 0.01)),
        P("viscous_friction", "load", lambda a, *_: friction.EyringDrag(0.03 * a, 4.0)),
        P("nonlinear_spring", "coupling", lambda a, *_: elastic.PlaySpring(30.0 * a, 1e5 * a, 0.0, 0.008)),
        P("gravity_load", "load", lambda a, *_: loads.Unbalance(0.15 * a, 0.4)),
        P("constant_load", "load", lambda a, *_: loads.ConstantLoad(0.12 * a)),
        P("backlash", "load", lambda a, *_: play.LooseInertia("J2", 0.0015, 0.03 * a, 0.2, 0.1)),
        P("inertia_error", "load", lambda a, *_: loads.WrongInertia("J2", 1e-3 * a)),
        P("actuator_gain", "actuator:T", lambda a, *_: actuators.Gain(-min(0.1 * a, 0.5))),
        P("actuator_lag", "actuator:T", lambda a, *_: actuators.TwoPoleLag(0.005 * a)),
        P("sensor_lag", "sensor:w2", lambda a, *_: sensors.LowPass(0.012 * a)),
        P("sensor_offset", "sensor:q2", lambda a, *_: sensors.Bias(8e-3 * a)),
        P("scatter", "load",
          lambda a, plan, rng: changing.scattered_damping(0.015 * a, -0.018, plan.runs, rng)),
        P("floor_vibration", "load",
          lambda a, plan, rng: foreign.FloorVibration(0.15 * a, 7.0, rng.uniform(0.0, 6.28, plan.runs))),
    )  # fmt: skip
