"""A cart with a pendulum that hangs from it, with position control of the cart."""

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
class CartPendulum(Mechanism):
    """Constants of cart and pendulum; the pendulum hangs down at the angle 0.

    Attributes:
        M: mass of the cart with its motor, kg.
        m: mass of the pendulum, kg.
        l: distance of the pendulum's centre of mass from its joint, m.
        I: moment of inertia of the pendulum about its centre of mass, kg m^2.
        b_c: damping of the cart, N s/m.
        b_p: damping of the joint, N m s/rad.
        kf: force constant of the drive, N/V.
        stiffness: proportional gain of the controller, V/m.
        damping: derivative gain of the controller, V s/m.
    """

    M: float = 1.1
    m: float = 0.3
    l: float = 0.28
    I: float = 0.008
    b_c: float = 6.0
    b_p: float = 0.006
    kf: float = 3.0
    stiffness: float = 70.0
    damping: float = 6.0

    limits = -12.0, 12.0
    ports = {"rail": (1.0, 0.0), "joint": (0.0, 1.0)}  # noqa: RUF012
    name = "cart_pendulum"
    input = "u"
    periods = (0.001, 0.002, 0.004)
    duration = 4.0
    runs = (8, 10)
    range = Range(0.16, 1.3)
    sensors = (
        Sensor("x", 0, False, 5e-5, 5e-5),
        Sensor("phi", 1, False, 2.0 * np.pi / 8192, 3e-4),
        Sensor("v", 0, True, 0.0, 0.004),
        Sensor("w", 1, True, 0.0, 0.02),
    )
    optional = ("v", "w")
    friction = {"b_c": "rail", "b_p": "joint"}  # noqa: RUF012
    doubtful = {"M": ("inertia_error",), "m": ("inertia_error",)}  # noqa: RUF012

    def start(self, runs: int, rng: np.random.Generator) -> Array:
        return np.stack([rng.uniform(-0.01, 0.01, runs), np.zeros(runs)])

    def held(self, reference: Array, slope: Array, c: Conditions) -> Array:
        return self.b_c / self.kf * slope

    def inertia(self, q: Array, c: Conditions) -> tuple[tuple[Array | float, ...], ...]:
        both = self.m * self.l * np.cos(q[1])
        return (self.M + self.m, both), (both, self.I + self.m * self.l**2)

    def efforts(self, q: Array, v: Array, u: Array, c: Conditions) -> tuple[Array, ...]:
        swing = self.m * self.l * np.sin(q[1])
        cart = self.kf * u - self.b_c * v[0] + swing * v[1] ** 2
        return cart, -self.b_p * v[1] - _GRAVITY * swing

    def load(self, name: str, u: Array) -> Array:
        return np.asarray(self.kf * u if name == "rail" else 0.0 * u)

    plantable = (
        P("coulomb_friction", "rail", lambda a, *_: friction.ArctanFriction(1.2 * a, 0.004)),
        P("coulomb_friction", "joint", lambda a, *_: friction.Coulomb(0.012 * a)),
        P("stribeck_friction", "rail", lambda a, *_: friction.LorentzFriction(0.8 * a, 2.0 * a, 0.04)),
        P("quadratic_drag", "joint", lambda a, *_: friction.Windage(4e-3 * a, 0.5)),
        P("hysteresis", "rail", lambda a, *_: friction.MaxwellSlip(1.5 * a, 0.012)),
        P("nonlinear_spring", "rail", lambda a, *_: elastic.OneSidedSpring(60.0 * a, 0.02, 1.0, 1.7, 0.1)),
        P("linear_spring", "joint", lambda a, *_: elastic.RubberSpring(0.12 * a, 0.0, 1.0)),
        P("constant_load", "rail",
          lambda a, *_: loads.ConstantLoad(1.2 * a), (("actuator_offset", "actuator:u"),)),
        P("flexible_transmission", "rail", lambda a, *_: play.Resonator("M", min(0.25 * a, 0.7), 9.0, 0.03)),
        P("actuator_dead_zone", "actuator:u", lambda a, *_: actuators.RoundedDeadZone(0.4 * a)),
        P("actuator_saturation", "actuator:u", lambda a, *_: actuators.SoftSaturation(4.0 / a)),
        P("actuator_lag", "actuator:u", lambda a, *_: actuators.TwoPoleLag(0.01 * a)),
        P("sensor_offset", "sensor:phi", lambda a, *_: sensors.Bias(0.03 * a)),
        P("sensor_delay", "sensor:w", lambda a, *_: sensors.Latency(0.01 * a)),
        P("drift", "rail", lambda a, plan, _: changing.WarmingBearing(5.0 * a, 15.0, plan.begin)),
        P("centrifugal", "joint", lambda a, *_: foreign.Centrifugal(6e-3 * a, 2.0, 0.7),
          (("quadratic_drag", "joint"),)),
    )  # fmt: skip
