"""An arm with two links in a vertical plane: a motor moves the shoulder, the elbow is passive."""

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

_GRAVITY = 9.81


@dataclass(frozen=True)
class TwoLinkArm(Mechanism):
    """Constants of the arm; both angles are 0 where it hangs down, that of the elbow is relative.

    Attributes:
        m1: mass of the upper arm, kg.
        l1: length of the upper arm, m.
        r1: distance of its centre of mass from the shoulder, m.
        I1: moment of inertia of upper arm and motor, about the shoulder without m1 r1^2, kg m^2.
        m2: mass of the forearm, kg.
        r2: distance of its centre of mass from the elbow, m.
        I2: moment of inertia of the forearm about its centre of mass, kg m^2.
        b1: damping of the shoulder, N m s/rad.
        b2: damping of the elbow, N m s/rad.
        stiffness: proportional gain of the controller, N m/rad.
        damping: derivative gain of the controller, N m s/rad.
    """

    m1: float = 0.6
    l1: float = 0.25
    r1: float = 0.13
    I1: float = 0.012
    m2: float = 0.4
    r2: float = 0.12
    I2: float = 0.0025
    b1: float = 0.08
    b2: float = 0.006
    stiffness: float = 14.0
    damping: float = 1.2

    limits = -8.0, 8.0
    ports = {"shoulder": (1.0, 0.0), "elbow": (0.0, 1.0)}  # noqa: RUF012
    name = "two_link_arm"
    input = "T"
    periods = (0.001, 0.002, 0.004)
    duration = 4.0
    runs = (8, 10)
    range = Range(0.7, 1.4)
    sensors = (
        Sensor("q1", 0, False, 2.0 * np.pi / 8192, 3e-4),
        Sensor("q2", 1, False, 2.0 * np.pi / 8192, 3e-4),
        Sensor("w1", 0, True, 0.0, 0.02),
        Sensor("w2", 1, True, 0.0, 0.02),
    )
    optional = ("w1", "w2")
    groups = ("morning", "evening")
    friction = {"b1": "shoulder", "b2": "elbow"}  # noqa: RUF012
    doubtful = {"I1": ("inertia_error",), "I2": ("inertia_error",)}  # noqa: RUF012

    def start(self, runs: int, rng: np.random.Generator) -> Array:
        return np.stack([rng.uniform(-0.05, 0.05, runs), np.zeros(runs)])

    def held(self, reference: Array, slope: Array, c: Conditions) -> Array:
        return _GRAVITY * (self.m1 * self.r1 + self.m2 * self.l1) * np.sin(reference) + self.b1 * slope

    def inertia(self, q: Array, c: Conditions) -> tuple[tuple[Array | float, ...], ...]:
        far, near = self.I2 + self.m2 * self.r2**2, self.m2 * self.l1 * self.r2 * np.cos(q[1])
        whole = self.I1 + self.m1 * self.r1**2 + self.m2 * self.l1**2 + far + 2.0 * near
        return (whole, far + near), (far + near, far)

    def efforts(self, q: Array, v: Array, u: Array, c: Conditions) -> tuple[Array, ...]:
        bend = self.m2 * self.l1 * self.r2 * np.sin(q[1])
        hanging = _GRAVITY * self.m2 * self.r2 * np.sin(q[0] + q[1])
        upper = _GRAVITY * (self.m1 * self.r1 + self.m2 * self.l1) * np.sin(q[0])
        shoulder = u - self.b1 * v[0] + bend * (2.0 * v[0] + v[1]) * v[1] - upper - hanging
        return shoulder, -self.b2 * v[1] - bend * v[0] ** 2 - hanging

    def load(self, name: str, u: Array) -> Array:
        return np.asarray(u if name == "shoulder" else 0.0 * u)

    plantable = (
        P("coulomb_friction", "elbow", lambda a, *_: friction.Coulomb(0.02 * a)),
        P("stribeck_friction", "shoulder", lambda a, *_: friction.TustinFriction(0.1 * a, 0.25 * a, 0.3)),
        P("position_dependent_friction", "shoulder", lambda a, *_: friction.TightSpot(0.3 * a, 0.2, 0.2)),
        P("viscous_friction", "elbow", lambda a, *_: friction.EyringDrag(0.015 * a, 3.0)),
        P("end_stop", "elbow", lambda a, *_: elastic.Bumper(4.0 * a, 0.2, -0.35, 0.3)),
        P("linear_spring", "elbow", lambda a, *_: elastic.RubberSpring(0.15 * a, 0.0, 1.0)),
        P("gravity_load", "shoulder", lambda a, *_: loads.Unbalance(0.3 * a, 0.2)),
        P("backlash", "shoulder", lambda a, *_: play.LooseInertia("I1", 0.006, 0.02 * a, 0.2, 0.1)),
        P("actuator_gain", "actuator:T", lambda a, *_: actuators.Gain(0.1 * a)),
        P("actuator_dead_zone", "actuator:T", lambda a, *_: actuators.RoundedDeadZone(0.15 * a)),
        P("input_delay", "actuator:T", lambda a, *_: actuators.Transport(0.004 * a)),
        P("sensor_gain", "sensor:w2", lambda a, *_: sensors.ScaleError(0.06 * a)),
        P("sensor_offset", "sensor:q2", lambda a, *_: sensors.Bias(0.03 * a)),
        P("scatter", "elbow",
          lambda a, plan, rng: changing.scattered_damping(4e-3 * a, -5e-3, plan.runs, rng)),
        P("sticky_valve", "actuator:T", lambda a, *_: foreign.StickyValve(0.25 * a)),
    )  # fmt: skip
