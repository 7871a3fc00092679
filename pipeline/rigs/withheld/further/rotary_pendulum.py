"""A rotary pendulum after Furuta: a motor turns an arm from which a pendulum hangs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.arrays import Array
from pipeline.rigs.withheld.effects import actuators, changing, foreign, friction, loads, play, sensors
from pipeline.rigs.withheld.effects.effect import Plantable as P
from pipeline.rigs.withheld.machine import Conditions, Range, Sensor
from pipeline.rigs.withheld.mechanism import Mechanism

_GRAVITY = 9.81


@dataclass(frozen=True)
class RotaryPendulum(Mechanism):
    """Constants of the rotary pendulum; the pendulum hangs down at the angle 0.

    Attributes:
        J: moment of inertia of arm and rotor, kg m^2.
        r: length of the arm, m.
        m: mass of the pendulum, kg.
        l: distance of its centre of mass from the joint, m.
        I: moment of inertia of the pendulum about its joint, kg m^2.
        b: damping of the arm, N m s/rad.
        b_p: damping of the joint, N m s/rad.
        kt: torque constant and back-EMF constant of the motor, N m/A.
        R: resistance of the motor, ohm.
        stiffness: proportional gain of the controller, V/rad.
        damping: derivative gain of the controller, V s/rad.
    """

    J: float = 2.5e-3
    r: float = 0.2
    m: float = 0.12
    l: float = 0.15
    I: float = 3.6e-3
    b: float = 2e-3
    b_p: float = 4e-4
    kt: float = 0.12
    R: float = 2.5
    stiffness: float = 40.0
    damping: float = 2.6

    limits = -24.0, 24.0
    ports = {"arm": (1.0, 0.0), "joint": (0.0, 1.0)}  # noqa: RUF012
    name = "rotary_pendulum"
    input = "u"
    periods = (0.001, 0.002)
    duration = 4.0
    runs = (8, 10)
    range = Range(0.9, 1.3)
    sensors = (
        Sensor("theta", 0, False, 2.0 * np.pi / 8192, 4e-4),
        Sensor("alpha", 1, False, 2.0 * np.pi / 8192, 4e-4),
        Sensor("omega", 0, True, 0.0, 0.02),
        Sensor("w", 1, True, 0.0, 0.03),
    )
    optional = ("omega", "w")
    friction = {"b": "arm", "b_p": "joint"}  # noqa: RUF012
    doubtful = {"J": ("inertia_error",), "R": ("actuator_gain",)}  # noqa: RUF012

    def start(self, runs: int, rng: np.random.Generator) -> Array:
        return np.stack([rng.uniform(-0.05, 0.05, runs), np.zeros(runs)])

    def held(self, reference: Array, slope: Array, c: Conditions) -> Array:
        return (self.kt + self.R * self.b / self.kt) * slope

    def inertia(self, q: Array, c: Conditions) -> tuple[tuple[Array | float, ...], ...]:
        both = self.m * self.r * self.l * np.cos(q[1])
        return (self.J + self.m * self.r**2 + self.I * np.sin(q[1]) ** 2, both), (both, self.I)

    def efforts(self, q: Array, v: Array, u: Array, c: Conditions) -> tuple[Array, ...]:
        sine, turn = np.sin(q[1]), self.I * np.sin(q[1]) * np.cos(q[1])
        torque = self.kt * (u - self.kt * v[0]) / self.R - self.b * v[0]
        arm = torque - 2.0 * turn * v[0] * v[1] + self.m * self.r * self.l * sine * v[1] ** 2
        return arm, turn * v[0] ** 2 - self.b_p * v[1] - self.m * _GRAVITY * self.l * sine

    def load(self, name: str, u: Array) -> Array:
        return np.asarray(self.kt / self.R * u if name == "arm" else 0.0 * u)

    plantable = (
        P("coulomb_friction", "joint", lambda a, *_: friction.Coulomb(3e-3 * a)),
        P("coulomb_friction", "arm", lambda a, *_: friction.ArctanFriction(0.025 * a, 0.05)),
        P("viscous_friction", "joint", lambda a, *_: friction.EyringDrag(1.2e-3 * a, 4.0)),
        P("quadratic_drag", "joint", lambda a, *_: friction.Windage(3e-4 * a, 0.5)),
        P("position_dependent_friction", "arm", lambda a, *_: friction.TightSpot(0.06 * a, 0.1, 0.2)),
        P("torque_ripple", "arm", lambda a, *_: loads.Ripple([0.03 * a, 0.012 * a], [6.0, 18.0], [0.2, 2.0])),
        P("gravity_load", "arm", lambda a, *_: loads.Unbalance(0.03 * a, 0.4)),
        P("inertia_error", "arm", lambda a, *_: loads.WrongInertia("J", 6e-4 * a)),
        P("backlash", "arm", lambda a, *_: play.LooseInertia("J", 7e-4, 0.02 * a, 0.2, 0.1)),
        P("actuator_offset", "actuator:u",
          lambda a, *_: actuators.Offset(0.5 * a), (("constant_load", "arm"),)),
        P("actuator_asymmetry", "actuator:u", lambda a, *_: actuators.UnequalSides(min(0.12 * a, 0.5), 0.4)),
        P("input_delay", "actuator:u", lambda a, *_: actuators.Transport(0.008 * a)),
        P("sensor_gain", "sensor:w", lambda a, *_: sensors.ScaleError(0.06 * a)),
        P("sensor_lag", "sensor:omega", lambda a, *_: sensors.LowPass(0.02 * a)),
        P("drift", "actuator:u",
          lambda a, plan, _: changing.FadingDrive(min(0.2 * a, 0.6), 15.0, plan.begin)),
        P("missed_counts", "sensor:alpha", lambda a, *_: foreign.MissedCounts(0.06 * a, 2.0)),
    )  # fmt: skip
