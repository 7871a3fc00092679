"""Machines that swing or roll: pendulums on a cart and on an arm, an arm with two links, ball and beam."""

from dataclasses import dataclass

import numpy as np

from pipeline.rigs.withheld.effects import actuators, changing, foreign, friction, loads, sensors
from pipeline.rigs.withheld.effects.effect import Plantable as P
from pipeline.rigs.withheld.machine import GRAVITY, Conditions, Range, Sensor
from pipeline.rigs.withheld.mechanism import Mechanism
from unmodelled.base.arrays import Array


@dataclass(frozen=True)
class CartPendulum(Mechanism):
    """Cart with a pendulum that hangs from it (down at the angle 0), with position control of the cart."""

    M: float = 1.1  # mass of the cart with its motor, kg
    m: float = 0.3  # mass of the pendulum, kg
    l: float = 0.28  # distance of the pendulum's centre of mass from its joint, m
    I: float = 0.008  # moment of inertia of the pendulum about its centre of mass, kg m^2
    b_c: float = 6.0  # damping of the cart, N s/m
    b_p: float = 0.006  # damping of the joint, N m s/rad
    kf: float = 3.0  # force constant of the drive, N/V
    stiffness: float = 70.0  # proportional gain of the controller, V/m
    damping: float = 6.0  # derivative gain of the controller, V s/m

    limits = -12.0, 12.0
    ports = {"rail": (1.0, 0.0), "joint": (0.0, 1.0)}  # noqa: RUF012
    name = "cart_pendulum"
    input = "u"
    periods = (0.001, 0.002, 0.004)
    duration = 4.0
    range = Range(0.16, 1.3)
    rest = -0.01, 0.01
    sensors = (
        Sensor("x", 0, False, 5e-5, 5e-5),
        Sensor("phi", 1, False, 2.0 * np.pi / 8192, 3e-4),
        Sensor("v", 0, True, 0.0, 0.004),
        Sensor("w", 1, True, 0.0, 0.02),
    )
    optional = ("v", "w")
    friction = {"b_c": "rail", "b_p": "joint"}  # noqa: RUF012
    doubtful = {"M": ("inertia_error",), "m": ("inertia_error",)}  # noqa: RUF012

    def held(self, reference: Array, slope: Array, c: Conditions) -> Array:
        return self.b_c / self.kf * slope

    def inertia(self, q: Array, c: Conditions) -> tuple[tuple[Array | float, ...], ...]:
        both = self.m * self.l * np.cos(q[1])
        return (self.M + self.m, both), (both, self.I + self.m * self.l**2)

    def efforts(self, q: Array, v: Array, u: Array, c: Conditions) -> tuple[Array, ...]:
        swing = self.m * self.l * np.sin(q[1])
        cart = self.kf * u - self.b_c * v[0] + swing * v[1] ** 2
        return cart, -self.b_p * v[1] - GRAVITY * swing

    def load(self, name: str, u: Array) -> Array:
        return np.asarray(self.kf * u if name == "rail" else 0.0 * u)

    plantable = (
        P("coulomb_friction", "rail", lambda a, *_: friction.ArctanFriction(1.2 * a, 0.004)),
        P("coulomb_friction", "joint", lambda a, *_: friction.Coulomb(0.012 * a)),
        P("stribeck_friction", "rail", lambda a, *_: friction.LorentzFriction(0.8 * a, 2.0 * a, 0.04)),
        P("quadratic_drag", "joint", lambda a, *_: friction.Windage(4e-3 * a, 0.5)),
        P("hysteresis", "rail", lambda a, *_: friction.MaxwellSlip(1.5 * a, 0.012)),
        P("nonlinear_spring", "rail", lambda a, *_: loads.OneSidedSpring(60.0 * a, 0.02, 1.0, 1.7, 0.1)),
        P("linear_spring", "joint", lambda a, *_: loads.RubberSpring(0.12 * a, 0.0, 1.0)),
        P("constant_load", "rail",
          lambda a, *_: loads.ConstantLoad(1.2 * a), (("actuator_offset", "actuator:u"),)),
        P("flexible_transmission", "rail", lambda a, *_: loads.Resonator("M", min(0.25 * a, 0.7), 9.0, 0.03)),
        P("actuator_dead_zone", "actuator:u", lambda a, *_: actuators.RoundedDeadZone(0.4 * a)),
        P("actuator_saturation", "actuator:u", lambda a, *_: actuators.SoftSaturation(4.0 / a)),
        P("actuator_lag", "actuator:u", lambda a, *_: actuators.TwoPoleLag(0.01 * a)),
        P("sensor_offset", "sensor:phi", lambda a, *_: sensors.Bias(0.03 * a)),
        P("sensor_delay", "sensor:w", lambda a, *_: sensors.Latency(0.01 * a)),
        P("drift", "rail", lambda a, plan, _: changing.WarmingBearing(5.0 * a, 15.0, plan.begin)),
        P("centrifugal", "joint", lambda a, *_: foreign.Centrifugal(6e-3 * a, 2.0, 0.7),
          (("quadratic_drag", "joint"),)),
    )  # fmt: skip


@dataclass(frozen=True)
class TwoLinkArm(Mechanism):
    """Arm with two links in a vertical plane: a motor moves the shoulder, the elbow is passive.

    Both angles are 0 where the arm hangs down, that of the elbow is relative.
    """

    m1: float = 0.6  # mass of the upper arm, kg
    l1: float = 0.25  # length of the upper arm, m
    r1: float = 0.13  # distance of its centre of mass from the shoulder, m
    I1: float = 0.012  # moment of inertia of upper arm and motor, about the shoulder without m1 r1^2, kg m^2
    m2: float = 0.4  # mass of the forearm, kg
    r2: float = 0.12  # distance of its centre of mass from the elbow, m
    I2: float = 0.0025  # moment of inertia of the forearm about its centre of mass, kg m^2
    b1: float = 0.08  # damping of the shoulder, N m s/rad
    b2: float = 0.006  # damping of the elbow, N m s/rad
    stiffness: float = 14.0  # proportional gain of the controller, N m/rad
    damping: float = 1.2  # derivative gain of the controller, N m s/rad

    limits = -8.0, 8.0
    ports = {"shoulder": (1.0, 0.0), "elbow": (0.0, 1.0)}  # noqa: RUF012
    name = "two_link_arm"
    input = "T"
    periods = (0.001, 0.002, 0.004)
    duration = 4.0
    range = Range(0.7, 1.4)
    rest = -0.05, 0.05
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

    def held(self, reference: Array, slope: Array, c: Conditions) -> Array:
        return GRAVITY * (self.m1 * self.r1 + self.m2 * self.l1) * np.sin(reference) + self.b1 * slope

    def inertia(self, q: Array, c: Conditions) -> tuple[tuple[Array | float, ...], ...]:
        far, near = self.I2 + self.m2 * self.r2**2, self.m2 * self.l1 * self.r2 * np.cos(q[1])
        whole = self.I1 + self.m1 * self.r1**2 + self.m2 * self.l1**2 + far + 2.0 * near
        return (whole, far + near), (far + near, far)

    def efforts(self, q: Array, v: Array, u: Array, c: Conditions) -> tuple[Array, ...]:
        bend = self.m2 * self.l1 * self.r2 * np.sin(q[1])
        hanging = GRAVITY * self.m2 * self.r2 * np.sin(q[0] + q[1])
        upper = GRAVITY * (self.m1 * self.r1 + self.m2 * self.l1) * np.sin(q[0])
        shoulder = u - self.b1 * v[0] + bend * (2.0 * v[0] + v[1]) * v[1] - upper - hanging
        return shoulder, -self.b2 * v[1] - bend * v[0] ** 2 - hanging

    def load(self, name: str, u: Array) -> Array:
        return np.asarray(u if name == "shoulder" else 0.0 * u)

    plantable = (
        P("coulomb_friction", "elbow", lambda a, *_: friction.Coulomb(0.02 * a)),
        P("stribeck_friction", "shoulder", lambda a, *_: friction.TustinFriction(0.1 * a, 0.25 * a, 0.3)),
        P("position_dependent_friction", "shoulder", lambda a, *_: friction.TightSpot(0.3 * a, 0.2, 0.2)),
        P("viscous_friction", "elbow", lambda a, *_: friction.EyringDrag(0.015 * a, 3.0)),
        P("end_stop", "elbow", lambda a, *_: loads.Bumper(4.0 * a, 0.2, -0.35, 0.3)),
        P("linear_spring", "elbow", lambda a, *_: loads.RubberSpring(0.15 * a, 0.0, 1.0)),
        P("gravity_load", "shoulder", lambda a, *_: loads.Unbalance(0.3 * a, 0.2)),
        P("backlash", "shoulder", lambda a, *_: loads.LooseInertia("I1", 0.006, 0.02 * a, 0.2, 0.1)),
        P("actuator_gain", "actuator:T", lambda a, *_: actuators.Gain(0.1 * a)),
        P("actuator_dead_zone", "actuator:T", lambda a, *_: actuators.RoundedDeadZone(0.15 * a)),
        P("input_delay", "actuator:T", lambda a, *_: actuators.Transport(0.004 * a)),
        P("sensor_gain", "sensor:w2", lambda a, *_: sensors.ScaleError(0.06 * a)),
        P("sensor_offset", "sensor:q2", lambda a, *_: sensors.Bias(0.03 * a)),
        P("scatter", "elbow", changing.scattered_damping(4e-3, -5e-3)),
        P("sticky_valve", "actuator:T", lambda a, *_: foreign.StickyValve(0.25 * a)),
    )  # fmt: skip


@dataclass(frozen=True)
class RotaryPendulum(Mechanism):
    """Rotary pendulum after Furuta: a motor turns an arm, from which a pendulum hangs (down at angle 0)."""

    J: float = 2.5e-3  # moment of inertia of arm and rotor, kg m^2
    r: float = 0.2  # length of the arm, m
    m: float = 0.12  # mass of the pendulum, kg
    l: float = 0.15  # distance of its centre of mass from the joint, m
    I: float = 3.6e-3  # moment of inertia of the pendulum about its joint, kg m^2
    b: float = 2e-3  # damping of the arm, N m s/rad
    b_p: float = 4e-4  # damping of the joint, N m s/rad
    kt: float = 0.12  # torque constant and back-EMF constant of the motor, N m/A
    R: float = 2.5  # resistance of the motor, ohm
    stiffness: float = 40.0  # proportional gain of the controller, V/rad
    damping: float = 2.6  # derivative gain of the controller, V s/rad

    limits = -24.0, 24.0
    ports = {"arm": (1.0, 0.0), "joint": (0.0, 1.0)}  # noqa: RUF012
    name = "rotary_pendulum"
    input = "u"
    duration = 4.0
    range = Range(0.9, 1.3)
    rest = -0.05, 0.05
    sensors = (
        Sensor("theta", 0, False, 2.0 * np.pi / 8192, 4e-4),
        Sensor("alpha", 1, False, 2.0 * np.pi / 8192, 4e-4),
        Sensor("omega", 0, True, 0.0, 0.02),
        Sensor("w", 1, True, 0.0, 0.03),
    )
    optional = ("omega", "w")
    friction = {"b": "arm", "b_p": "joint"}  # noqa: RUF012
    doubtful = {"J": ("inertia_error",), "R": ("actuator_gain",)}  # noqa: RUF012

    def held(self, reference: Array, slope: Array, c: Conditions) -> Array:
        return (self.kt + self.R * self.b / self.kt) * slope

    def inertia(self, q: Array, c: Conditions) -> tuple[tuple[Array | float, ...], ...]:
        both = self.m * self.r * self.l * np.cos(q[1])
        return (self.J + self.m * self.r**2 + self.I * np.sin(q[1]) ** 2, both), (both, self.I)

    def efforts(self, q: Array, v: Array, u: Array, c: Conditions) -> tuple[Array, ...]:
        sine, turn = np.sin(q[1]), self.I * np.sin(q[1]) * np.cos(q[1])
        torque = self.kt * (u - self.kt * v[0]) / self.R - self.b * v[0]
        arm = torque - 2.0 * turn * v[0] * v[1] + self.m * self.r * self.l * sine * v[1] ** 2
        return arm, turn * v[0] ** 2 - self.b_p * v[1] - self.m * GRAVITY * self.l * sine

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
        P("backlash", "arm", lambda a, *_: loads.LooseInertia("J", 7e-4, 0.02 * a, 0.2, 0.1)),
        P("actuator_offset", "actuator:u",
          lambda a, *_: actuators.Offset(0.5 * a), (("constant_load", "arm"),)),
        P("actuator_asymmetry", "actuator:u", lambda a, *_: actuators.UnequalSides(min(0.12 * a, 0.5), 0.4)),
        P("input_delay", "actuator:u", lambda a, *_: actuators.Transport(0.008 * a)),
        P("sensor_gain", "sensor:w", lambda a, *_: sensors.ScaleError(0.06 * a)),
        P("sensor_lag", "sensor:omega", lambda a, *_: sensors.LowPass(0.02 * a)),
        P("drift", "actuator:u", changing.fading_drive(0.2, 15.0)),
        P("missed_counts", "sensor:alpha", lambda a, *_: foreign.MissedCounts(0.06 * a, 2.0)),
    )  # fmt: skip


@dataclass(frozen=True)
class BallBeam(Mechanism):
    """Ball that rolls on a beam, which a motor tilts; a controller balances the ball.

    The ball rolls without slip, and its place is measured from the pivot.
    """

    m: float = 0.11  # mass of the ball, kg
    J: float = 0.02  # moment of inertia of beam and motor, kg m^2
    b_r: float = 0.03  # rolling resistance of the ball, N s/m
    b: float = 0.08  # damping of the pivot, N m s/rad
    stiffness: float = 6.0  # proportional gain of the controller of the angle, N m/rad
    damping: float = 0.5  # derivative gain of the controller of the angle, N m s/rad
    tilt: float = 0.7  # angle by which the controller tilts the beam per deviation of the ball, rad/m
    calm: float = 0.5  # angle by which it tilts the beam per deviation of the ball's speed, rad s/m

    limits = -3.0, 3.0
    ports = {"ball": (1.0, 0.0), "pivot": (0.0, 1.0)}  # noqa: RUF012
    name = "ball_beam"
    input = "T"
    duration = 5.0
    range = Range(0.12, 0.5)
    rest = -0.02, 0.02
    sensors = (
        Sensor("r", 0, False, 5e-5, 1e-4),
        Sensor("alpha", 1, False, 2.0 * np.pi / 16384, 2e-4),
        Sensor("v", 0, True, 0.0, 0.004),
        Sensor("omega", 1, True, 0.0, 0.01),
    )
    optional = ("v",)
    friction = {"b_r": "ball", "b": "pivot"}  # noqa: RUF012
    doubtful = {"J": ("inertia_error",)}  # noqa: RUF012

    def held(self, reference: Array, slope: Array, c: Conditions) -> Array:
        return self.m * GRAVITY * reference

    def command(self, reference: Array, slope: Array, q: Array, v: Array, c: Conditions) -> Array:
        angle = np.clip(self.tilt * (q[0] - reference) + self.calm * (v[0] - slope), -0.3, 0.3)
        u = self.held(q[0], slope, c) + self.stiffness * (angle - q[1]) - self.damping * v[1]
        return np.asarray(np.clip(u, *self.limits))

    def inertia(self, q: Array, c: Conditions) -> tuple[tuple[Array | float, ...], ...]:
        return (1.4 * self.m, 0.0), (0.0, self.J + self.m * q[0] ** 2)

    def efforts(self, q: Array, v: Array, u: Array, c: Conditions) -> tuple[Array, ...]:
        ball = self.m * (q[0] * v[1] ** 2 - GRAVITY * np.sin(q[1])) - self.b_r * v[0]
        weight = self.m * q[0] * (2.0 * v[0] * v[1] + GRAVITY * np.cos(q[1]))
        return ball, u - self.b * v[1] - weight

    def load(self, name: str, u: Array) -> Array:
        return np.asarray(u if name == "pivot" else 0.0 * u)

    plantable = (
        P("coulomb_friction", "pivot", lambda a, *_: friction.Coulomb(0.03 * a)),
        P("stribeck_friction", "pivot", lambda a, *_: friction.TustinFriction(0.02 * a, 0.05 * a, 0.1)),
        P("viscous_friction", "ball", lambda a, *_: friction.EyringDrag(0.08 * a, 0.4)),
        P("quadratic_drag", "ball", lambda a, *_: friction.Windage(0.5 * a, 0.03)),
        P("nonlinear_spring", "pivot", lambda a, *_: loads.OneSidedSpring(1.0 * a, 0.02, 1.0, 1.7, 0.1)),
        P("linear_spring", "pivot", lambda a, *_: loads.RubberSpring(0.6 * a, 0.0, 0.3)),
        P("constant_load", "ball", lambda a, *_: loads.ConstantLoad(0.01 * a)),
        P("inertia_error", "pivot", lambda a, *_: loads.WrongInertia("J", 4e-3 * a)),
        P("backlash", "pivot", lambda a, *_: loads.LooseInertia("J", 6e-3, 4e-3 * a, 0.1, 0.05)),
        P("actuator_gain", "actuator:T", lambda a, *_: actuators.Gain(0.1 * a)),
        P("actuator_dead_zone", "actuator:T", lambda a, *_: actuators.RoundedDeadZone(0.02 * a)),
        P("sensor_offset", "sensor:alpha", lambda a, *_: sensors.Bias(8e-3 * a)),
        P("sensor_gain", "sensor:omega", lambda a, *_: sensors.ScaleError(0.06 * a)),
        P("floor_vibration", "pivot", foreign.floor_vibration(0.03, 4.0)),
    )  # fmt: skip
