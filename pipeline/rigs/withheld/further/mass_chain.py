"""Three masses in a row, with springs and dampers between them; a force acts on the first one."""

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
class MassChain(Mechanism):
    """Constants of the chain; the first spring is fixed to the frame.

    Attributes:
        m1: first mass, kg.
        m2: second mass, kg.
        m3: third mass, kg.
        k1: stiffness between the frame and the first mass, N/m.
        k2: stiffness between first and second mass, N/m.
        k3: stiffness between second and third mass, N/m.
        b1: damping between the frame and the first mass, N s/m.
        b2: damping between first and second mass, N s/m.
        b3: damping between second and third mass, N s/m.
        stiffness: proportional gain of the controller, N/m.
        damping: derivative gain of the controller, N s/m.
    """

    m1: float = 1.5
    m2: float = 1.0
    m3: float = 0.8
    k1: float = 900.0
    k2: float = 700.0
    k3: float = 500.0
    b1: float = 2.5
    b2: float = 1.5
    b3: float = 1.2
    stiffness: float = 200.0
    damping: float = 8.0

    limits = -40.0, 40.0
    ports = {"first": (1.0, 0.0, 0.0), "second": (0.0, 1.0, 0.0), "third": (0.0, 0.0, 1.0)}  # noqa: RUF012
    name = "mass_chain"
    input = "F"
    periods = (0.001, 0.002, 0.004)
    duration = 4.0
    runs = (6, 8, 10)
    range = Range(0.015, 3.5)
    sensors = (
        Sensor("x1", 0, False, 1e-5, 2e-5),
        Sensor("x2", 1, False, 1e-5, 2e-5),
        Sensor("x3", 2, False, 1e-5, 2e-5),
        Sensor("v1", 0, True, 0.0, 0.002),
        Sensor("v2", 1, True, 0.0, 0.002),
        Sensor("v3", 2, True, 0.0, 0.002),
    )
    optional = ("v1", "v2", "v3")
    friction = {"b1": "first"}  # noqa: RUF012
    doubtful = {"m2": ("inertia_error",), "k1": ("linear_spring",)}  # noqa: RUF012

    def start(self, runs: int, rng: np.random.Generator) -> Array:
        return np.zeros((3, runs))

    def held(self, reference: Array, slope: Array, c: Conditions) -> Array:
        return self.k1 * reference + self.b1 * slope

    def inertia(self, q: Array, c: Conditions) -> tuple[tuple[float, ...], ...]:
        return (self.m1, 0.0, 0.0), (0.0, self.m2, 0.0), (0.0, 0.0, self.m3)

    def efforts(self, q: Array, v: Array, u: Array, c: Conditions) -> tuple[Array, ...]:
        near = self.k2 * (q[0] - q[1]) + self.b2 * (v[0] - v[1])
        far = self.k3 * (q[1] - q[2]) + self.b3 * (v[1] - v[2])
        return u - self.k1 * q[0] - self.b1 * v[0] - near, near - far, far

    def load(self, name: str, u: Array) -> Array:
        return np.asarray(u if name == "first" else 0.0 * u)

    plantable = (
        P("coulomb_friction", "third", lambda a, *_: friction.Coulomb(0.4 * a)),
        P("coulomb_friction", "first", lambda a, *_: friction.ArctanFriction(1.0 * a, 0.004)),
        P("stribeck_friction", "second", lambda a, *_: friction.LorentzFriction(0.3 * a, 0.9 * a, 0.03)),
        P("quadratic_drag", "third", lambda a, *_: friction.Windage(8.0 * a, 0.02)),
        P("viscous_friction", "second", lambda a, *_: friction.EyringDrag(1.5 * a, 0.3)),
        P("linear_spring", "third", lambda a, *_: elastic.RubberSpring(60.0 * a, 0.0, 0.03)),
        P("nonlinear_spring", "second", lambda a, *_: elastic.PlaySpring(200.0 * a, 4e5 * a, 0.0, 0.006)),
        P("end_stop", "third", lambda a, *_: elastic.Bumper(8e3 * a, 0.5, -0.012, 0.01)),
        P("constant_load", "second", lambda a, *_: loads.ConstantLoad(1.2 * a)),
        P("inertia_error", "third", lambda a, *_: loads.WrongInertia("m3", 0.12 * a)),
        P("flexible_transmission", "third",
          lambda a, *_: play.Resonator("m3", min(0.15 * a, 0.5), 9.0, 0.03)),
        P("actuator_gain", "actuator:F", lambda a, *_: actuators.Gain(0.1 * a)),
        P("actuator_dead_zone", "actuator:F", lambda a, *_: actuators.RoundedDeadZone(1.0 * a)),
        P("input_delay", "actuator:F", lambda a, *_: actuators.Transport(0.008 * a)),
        P("sensor_gain", "sensor:x2", lambda a, *_: sensors.ScaleError(0.04 * a)),
        P("sensor_lag", "sensor:v3", lambda a, *_: sensors.LowPass(0.015 * a)),
        P("scatter", "first", lambda a, plan, rng: changing.scattered_damping(1.5 * a, -2.2, plan.runs, rng)),
        P("floor_vibration", "second",
          lambda a, plan, rng: foreign.FloorVibration(1.0 * a, 6.0, rng.uniform(0.0, 6.28, plan.runs))),
    )  # fmt: skip
