"""A ball that rolls on a beam, which a motor tilts; a controller balances the ball."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.arrays import Array
from pipeline.rigs.withheld.effects import actuators, elastic, foreign, friction, loads, play, sensors
from pipeline.rigs.withheld.effects.effect import Plantable as P
from pipeline.rigs.withheld.machine import Conditions, Range, Sensor
from pipeline.rigs.withheld.mechanism import Mechanism

_GRAVITY = 9.81


@dataclass(frozen=True)
class BallBeam(Mechanism):
    """Constants of ball and beam; the ball rolls without slip, and its place is measured from the pivot.

    Attributes:
        m: mass of the ball, kg.
        J: moment of inertia of beam and motor, kg m^2.
        b_r: rolling resistance of the ball, N s/m.
        b: damping of the pivot, N m s/rad.
        stiffness: proportional gain of the controller of the angle, N m/rad.
        damping: derivative gain of the controller of the angle, N m s/rad.
        tilt: angle by which the controller tilts the beam per deviation of the ball, rad/m.
        calm: angle by which it tilts the beam per deviation of the ball's speed, rad s/m.
    """

    m: float = 0.11
    J: float = 0.02
    b_r: float = 0.03
    b: float = 0.08
    stiffness: float = 6.0
    damping: float = 0.5
    tilt: float = 0.7
    calm: float = 0.5

    limits = -3.0, 3.0
    ports = {"ball": (1.0, 0.0), "pivot": (0.0, 1.0)}  # noqa: RUF012
    name = "ball_beam"
    input = "T"
    periods = (0.001, 0.002)
    duration = 5.0
    runs = (8, 10)
    range = Range(0.12, 0.5)
    sensors = (
        Sensor("r", 0, False, 5e-5, 1e-4),
        Sensor("alpha", 1, False, 2.0 * np.pi / 16384, 2e-4),
        Sensor("v", 0, True, 0.0, 0.004),
        Sensor("omega", 1, True, 0.0, 0.01),
    )
    optional = ("v",)
    friction = {"b_r": "ball", "b": "pivot"}  # noqa: RUF012
    doubtful = {"J": ("inertia_error",)}  # noqa: RUF012

    def start(self, runs: int, rng: np.random.Generator) -> Array:
        return np.stack([rng.uniform(-0.02, 0.02, runs), np.zeros(runs)])

    def held(self, reference: Array, slope: Array, c: Conditions) -> Array:
        return self.m * _GRAVITY * reference

    def command(self, reference: Array, slope: Array, q: Array, v: Array, c: Conditions) -> Array:
        angle = np.clip(self.tilt * (q[0] - reference) + self.calm * (v[0] - slope), -0.3, 0.3)
        u = self.held(q[0], slope, c) + self.stiffness * (angle - q[1]) - self.damping * v[1]
        return np.asarray(np.clip(u, *self.limits))

    def inertia(self, q: Array, c: Conditions) -> tuple[tuple[Array | float, ...], ...]:
        return (1.4 * self.m, 0.0), (0.0, self.J + self.m * q[0] ** 2)

    def efforts(self, q: Array, v: Array, u: Array, c: Conditions) -> tuple[Array, ...]:
        ball = self.m * (q[0] * v[1] ** 2 - _GRAVITY * np.sin(q[1])) - self.b_r * v[0]
        weight = self.m * q[0] * (2.0 * v[0] * v[1] + _GRAVITY * np.cos(q[1]))
        return ball, u - self.b * v[1] - weight

    def load(self, name: str, u: Array) -> Array:
        return np.asarray(u if name == "pivot" else 0.0 * u)

    plantable = (
        P("coulomb_friction", "pivot", lambda a, *_: friction.Coulomb(0.03 * a)),
        P("stribeck_friction", "pivot", lambda a, *_: friction.TustinFriction(0.02 * a, 0.05 * a, 0.1)),
        P("viscous_friction", "ball", lambda a, *_: friction.EyringDrag(0.08 * a, 0.4)),
        P("quadratic_drag", "ball", lambda a, *_: friction.Windage(0.5 * a, 0.03)),
        P("nonlinear_spring", "pivot", lambda a, *_: elastic.OneSidedSpring(1.0 * a, 0.02, 1.0, 1.7, 0.1)),
        P("linear_spring", "pivot", lambda a, *_: elastic.RubberSpring(0.6 * a, 0.0, 0.3)),
        P("constant_load", "ball", lambda a, *_: loads.ConstantLoad(0.01 * a)),
        P("inertia_error", "pivot", lambda a, *_: loads.WrongInertia("J", 4e-3 * a)),
        P("backlash", "pivot", lambda a, *_: play.LooseInertia("J", 6e-3, 4e-3 * a, 0.1, 0.05)),
        P("actuator_gain", "actuator:T", lambda a, *_: actuators.Gain(0.1 * a)),
        P("actuator_dead_zone", "actuator:T", lambda a, *_: actuators.RoundedDeadZone(0.02 * a)),
        P("sensor_offset", "sensor:alpha", lambda a, *_: sensors.Bias(8e-3 * a)),
        P("sensor_gain", "sensor:omega", lambda a, *_: sensors.ScaleError(0.06 * a)),
        P("floor_vibration", "pivot",
          lambda a, plan, rng: foreign.FloorVibration(0.03 * a, 4.0, rng.uniform(0.0, 6.28, plan.runs))),
    )  # fmt: skip
