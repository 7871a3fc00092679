"""An axis with a ball screw: a motor moves a table with a payload, with position control."""

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
class BallScrew(Mechanism):
    """Constants of the axis; the payload m (kg) is the operating point.

    Attributes:
        J: moment of inertia of motor and screw, kg m^2.
        b: damping of motor and screw, N m s/rad.
        m_t: mass of the table, kg.
        b_t: damping of the table, N s/m.
        n: travel of the table per angle of the screw, m/rad.
        kt: torque constant of the motor, N m/A.
        stiffness: proportional gain of the controller, A/rad.
        damping: derivative gain of the controller, A s/rad.
    """

    J: float = 5e-4
    b: float = 2e-3
    m_t: float = 12.0
    b_t: float = 90.0
    n: float = 0.02 / (2.0 * np.pi)
    kt: float = 0.45
    stiffness: float = 1.5
    damping: float = 0.06

    limits = -16.0, 16.0
    name = "ball_screw"
    input = "i"
    periods = (0.001, 0.002)
    duration = 3.0
    runs = (9, 12)
    range = Range(22.0, 1.5)
    sensors = (Sensor("theta", 0, False, 2.0 * np.pi / 4096, 5e-4), Sensor("omega", 0, True, 0.0, 1.0))
    optional = ("omega",)
    factors = {"m": (0.0, 15.0, 40.0)}  # noqa: RUF012
    friction = {"b": "screw", "b_t": "table"}  # noqa: RUF012
    doubtful = {"J": ("inertia_error",), "kt": ("actuator_gain",)}  # noqa: RUF012

    @property
    def ports(self) -> dict[str, tuple[float, ...]]:
        """Position of screw and table per angle of the screw."""
        return {"screw": (1.0,), "table": (self.n,)}

    def start(self, runs: int, rng: np.random.Generator) -> Array:
        return rng.uniform(-1.0, 1.0, (1, runs))

    def held(self, reference: Array, slope: Array, c: Conditions) -> Array:
        return (self.b + self.n**2 * self.b_t) / self.kt * slope

    def inertia(self, q: Array, c: Conditions) -> tuple[tuple[Array, ...], ...]:
        return ((self.J + self.n**2 * (self.m_t + c["m"]),),)

    def efforts(self, q: Array, v: Array, u: Array, c: Conditions) -> tuple[Array, ...]:
        return (self.kt * u - (self.b + self.n**2 * self.b_t) * v[0],)

    def load(self, name: str, u: Array) -> Array:
        return np.asarray(self.kt * u / (1.0 if name == "screw" else self.n))

    plantable = (
        P("coulomb_friction", "table",
          lambda a, *_: friction.Coulomb(40.0 * a), (("coulomb_friction", "screw"),)),
        P("stribeck_friction", "table", lambda a, *_: friction.TustinFriction(25.0 * a, 60.0 * a, 0.02),
          (("stribeck_friction", "screw"),)),
        P("load_friction", "screw", lambda a, *_: friction.GearFriction(min(0.15 * a, 0.5), 0.05),
          (("load_friction", "table"),)),
        P("position_dependent_friction", "table", lambda a, *_: friction.TightSpot(90.0 * a, 0.01, 0.012)),
        P("linear_spring", "table", lambda a, *_: elastic.RubberSpring(1500.0 * a, 0.0, 0.1),
          (("linear_spring", "screw"),)),
        P("end_stop", "table", lambda a, *_: elastic.Bumper(2e5 * a, 0.4, -0.035, 0.03)),
        P("torque_ripple", "screw", lambda a, *_: loads.Ripple([0.12 * a, 0.06 * a], [1.0, 4.0], [0.5, 1.2])),
        P("backlash", "screw", lambda a, *_: play.LooseInertia("J", 1e-4, 0.15 * a, 0.2, 0.5)),
        P("actuator_offset", "actuator:i", lambda a, *_: actuators.Offset(0.25 * a),
          (("constant_load", "screw"), ("constant_load", "table"))),
        P("actuator_asymmetry", "actuator:i", lambda a, *_: actuators.UnequalSides(min(0.12 * a, 0.5), 0.2)),
        P("actuator_rate_limit", "actuator:i", lambda a, *_: actuators.SlowAmplifier(1500.0 / a)),
        P("sensor_delay", "sensor:omega", lambda a, *_: sensors.Latency(0.006 * a)),
        P("drift", "actuator:i",
          lambda a, plan, _: changing.FadingDrive(min(0.2 * a, 0.6), 12.0, plan.begin)),
        P("heated_friction", "table",
          lambda a, plan, _: foreign.HeatedFriction((20.0 + 1.5 * plan.conditions["m"]) * a, 12.0, 3.0),
          (("coulomb_friction", "table"), ("drift", "table"))),
    )  # fmt: skip
