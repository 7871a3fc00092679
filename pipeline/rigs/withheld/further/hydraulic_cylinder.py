"""A hydraulic cylinder that a servo valve moves; the pressure of its oil is a state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.arrays import Array
from pipeline.rigs.withheld.effects import (
    actuators,
    changing,
    elastic,
    flows,
    foreign,
    friction,
    loads,
    sensors,
)
from pipeline.rigs.withheld.effects.effect import Plantable as P
from pipeline.rigs.withheld.machine import Conditions, Range, Sensor
from pipeline.rigs.withheld.mechanism import Mechanism


@dataclass(frozen=True)
class HydraulicCylinder(Mechanism):
    """Constants of the cylinder; the pressure is the difference between its chambers, the load m (kg) the
    operating point.

    Attributes:
        m_p: mass of the piston, kg.
        b: damping of the seals, N s/m.
        A: area of the piston, m^2.
        C: volume that the oil gives way per pressure, m^3/Pa.
        k_q: flow of the valve per voltage, m^3/(s V).
        k_l: leakage of the piston per pressure, m^3/(s Pa).
        stiffness: proportional gain of the controller, V/m.
        damping: derivative gain of the controller, V s/m.
    """

    m_p: float = 40.0
    b: float = 500.0
    A: float = 6e-4
    C: float = 3.5e-13
    k_q: float = 5e-5
    k_l: float = 6e-12
    stiffness: float = 70.0
    damping: float = 0.0

    limits = -10.0, 10.0
    levels = 1
    ports = {"rod": (1.0, 0.0), "oil": (0.0, 1.0)}  # noqa: RUF012
    name = "hydraulic_cylinder"
    input = "u"
    periods = (0.001, 0.002)
    duration = 3.0
    runs = (9, 12)
    range = Range(0.06, 1.2)
    sensors = (
        Sensor("x", 0, False, 1e-5, 2e-5),
        Sensor("v", 0, True, 0.0, 0.004),
        Sensor("p", 1, False, 1e3, 4e3),
    )
    optional = ("v",)
    factors = {"m": (20.0, 60.0, 110.0)}  # noqa: RUF012
    friction = {"b": "rod", "k_l": "oil"}  # noqa: RUF012
    doubtful = {"m_p": ("inertia_error",)}  # noqa: RUF012

    def start(self, runs: int, rng: np.random.Generator) -> Array:
        return np.stack([rng.uniform(-0.002, 0.002, runs), np.zeros(runs)])

    def held(self, reference: Array, slope: Array, c: Conditions) -> Array:
        return (self.A + self.k_l * self.b / self.A) / self.k_q * slope

    def inertia(self, q: Array, c: Conditions) -> tuple[tuple[Array | float, ...], ...]:
        return (self.m_p + c["m"], 0.0), (0.0, self.C)

    def efforts(self, q: Array, v: Array, u: Array, c: Conditions) -> tuple[Array, ...]:
        return self.A * q[1] - self.b * v[0], self.k_q * u - self.k_l * q[1] - self.A * v[0]

    plantable = (
        P("coulomb_friction", "rod", lambda a, *_: friction.Coulomb(80.0 * a)),
        P("stribeck_friction", "rod", lambda a, *_: friction.TustinFriction(50.0 * a, 130.0 * a, 0.03)),
        P("position_dependent_friction", "rod", lambda a, *_: friction.TightSpot(200.0 * a, 0.01, 0.015)),
        P("linear_spring", "rod", lambda a, *_: elastic.RubberSpring(3e3 * a, 0.0, 0.08)),
        P("end_stop", "rod", lambda a, *_: elastic.Bumper(1e6 * a, 0.4, -0.03, 0.025)),
        P("constant_load", "rod", lambda a, *_: loads.ConstantLoad(120.0 * a)),
        P("inertia_error", "rod", lambda a, *_: loads.WrongInertia("m_p", 12.0 * a)),
        P("linear_loss", "oil", lambda a, *_: flows.Gap(1e-11 * a, 2e-7)),
        P("overflow", "oil", lambda a, *_: flows.ReliefValve(6e-11 * a, 2e5, 1e4)),
        P("storage", "oil", lambda a, *_: flows.SecondStore(5e-11 * a, 2e-13 * a, 2e5)),
        P("actuator_offset", "actuator:u", lambda a, *_: actuators.Offset(0.3 * a)),
        P("actuator_dead_zone", "actuator:u", lambda a, *_: actuators.RoundedDeadZone(0.3 * a)),
        P("actuator_lag", "actuator:u", lambda a, *_: actuators.TwoPoleLag(0.008 * a)),
        P("sensor_gain", "sensor:p", lambda a, *_: sensors.ScaleError(0.06 * a)),
        P("sensor_delay", "sensor:v", lambda a, *_: sensors.Latency(0.005 * a)),
        P("scatter", "rod",
          lambda a, plan, rng: changing.scattered_damping(250.0 * a, -450.0, plan.runs, rng)),
        P("sticky_valve", "actuator:u", lambda a, *_: foreign.StickyValve(0.4 * a)),
    )  # fmt: skip
