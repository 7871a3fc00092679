"""Machines whose shaft moves a part along a line: a slider-crank and a cam drive."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pipeline.rigs.withheld.effects import actuators, changing, foreign, friction, loads, sensors
from pipeline.rigs.withheld.effects.effect import Plantable as P
from pipeline.rigs.withheld.effects.effect import Port
from pipeline.rigs.withheld.machine import GRAVITY, Conditions, Machine, Range, Sensor
from unmodelled.base.arrays import Array


class Linkage(NamedTuple):
    """First and second derivatives by the angle of the crank, each of shape (n,)."""

    slider: tuple[Array, Array]  # position, m/rad and m/rad^2
    rod_x: tuple[Array, Array]  # of the rod's centre, m/rad and m/rad^2
    rod_y: tuple[Array, Array]  # of the rod's centre, m/rad and m/rad^2
    rod_angle: tuple[Array, Array]  # 1 and 1/rad


@dataclass(frozen=True)
class SliderCrank(Machine):
    """Slider-crank with speed control; the crank turns in a vertical plane, the slider moves horizontally."""

    m1: float = 0.23  # mass of the crank, kg
    m2: float = 0.35  # mass of the rod, kg
    m3: float = 0.77  # mass of the slider, kg
    l1: float = 0.05  # length of the crank, m
    l2: float = 0.29  # length of the rod, m
    J1: float = 0.0034  # inertia of motor and crank, kg m^2
    B_m: float = 0.007  # damping of the shaft, N m s/rad
    gain: float = 0.12  # gain of the speed controller, N m s/rad
    torque: float = 5.0  # largest torque of the controller, N m

    name = "slider_crank"
    input = "T"
    periods = (5e-4, 0.001)
    duration = 2.0
    range = Range(20.0, 2.5)
    rest = 0.0, 2.0 * np.pi
    sensors = (
        Sensor("theta", 0, False, 2.0 * np.pi / 8192, 1.5e-3, wraps=True),
        Sensor("omega", 0, True, 0.0, 0.08),
    )
    optional = ("omega",)
    groups = ("first", "second")
    friction = {"B_m": "shaft"}  # noqa: RUF012
    doubtful = {"m3": ("inertia_error",), "m2": ("inertia_error",)}  # noqa: RUF012

    def command(self, reference: Array, slope: Array, q: Array, v: Array, c: Conditions) -> Array:
        return np.asarray(np.clip(self.gain * (reference - v[0]), -self.torque, self.torque))

    def linkage(self, theta: Array) -> Linkage:
        """Solve the closed loop of the linkage. Takes theta (n,) in rad."""
        sine, cosine, ratio = np.sin(theta), np.cos(theta), self.l1 / self.l2
        s = ratio * sine  # the rod falls by its angle phi: sin(phi) = s
        c = np.sqrt(1.0 - s * s)
        turn = ratio * cosine / c
        bend = (s * turn * turn - ratio * sine) / c
        swing, rise = s * turn, c * turn * turn + s * bend
        return Linkage(
            (-self.l1 * sine - self.l2 * swing, -self.l1 * cosine - self.l2 * rise),
            (-self.l1 * sine - 0.5 * self.l2 * swing, -self.l1 * cosine - 0.5 * self.l2 * rise),
            (0.5 * self.l1 * cosine, -0.5 * self.l1 * sine),
            (turn, bend),
        )

    def _bodies(self, at: Linkage) -> tuple[tuple[float, tuple[Array, Array]], ...]:
        rod = self.m2 * self.l2**2 / 12.0
        return (self.m3, at.slider), (self.m2, at.rod_x), (self.m2, at.rod_y), (rod, at.rod_angle)

    def _inertia(self, at: Linkage) -> Array:
        return np.asarray(self.J1 + sum(m * first * first for m, (first, _) in self._bodies(at)))

    def rates(self, q: Array, v: Array, u: Array, c: Conditions) -> Array:
        at = self.linkage(q[0])
        pulled = sum(m * first * second for m, (first, second) in self._bodies(at))
        weight = GRAVITY * (0.5 * self.m1 * self.l1 * np.cos(q[0]) + self.m2 * at.rod_y[0])
        torque = u - self.B_m * v[0] - weight - pulled * v[0] ** 2
        return np.asarray(torque / self._inertia(at))[None]

    def port(self, name: str, q: Array, v: Array, c: Conditions) -> Port:
        at, theta, omega = self.linkage(q[0]), q[0], v[0]
        if name == "shaft":
            mobility = 1.0 / self._inertia(at)
            return Port(theta, omega, -mobility[None], mobility)
        k = at.slider[0]
        rod = np.sqrt(self.l2**2 - (self.l1 * np.sin(theta)) ** 2)
        d = self.l1 * np.cos(theta) + rod - (self.l2 - self.l1)
        response = -k / self._inertia(at)
        return Port(d, k * omega, response[None], -k * response)

    plantable = (
        P("viscous_friction", "slider", lambda a, *_: friction.EyringDrag(6.0 * a, 1.5), local=True),
        P("coulomb_friction", "slider", lambda a, *_: friction.Coulomb(2.0 * a), local=True),
        P("coulomb_friction", "shaft", lambda a, *_: friction.ArctanFriction(0.1 * a, 0.05)),
        P("stribeck_friction", "slider", lambda a, *_: friction.LorentzFriction(1.5 * a, 4.5 * a, 0.1)),
        P("quadratic_drag", "slider", lambda a, *_: friction.Windage(10.0 * a, 0.05)),
        P("position_dependent_friction", "shaft", lambda a, *_: friction.RubbingArc(0.2 * a, 1.0)),
        P("hysteresis", "slider", lambda a, *_: friction.MaxwellSlip(3.0 * a, 0.03)),
        P("linear_spring", "slider", lambda a, *_: loads.RubberSpring(40.0 * a, 0.02, 0.2), local=True),
        P("nonlinear_spring", "slider", lambda a, *_: loads.OneSidedSpring(120.0 * a, 0.04, 1.0, 2.2, 0.05)),
        P("end_stop", "slider", lambda a, *_: loads.Bumper(1.5e4 * a, 0.3, -1.0, 0.09)),
        P("constant_load", "slider",
          lambda a, *_: loads.ConstantLoad(2.0 * a), (("gravity_load", "slider"),)),
        P("gravity_load", "shaft", lambda a, *_: loads.Unbalance(0.12 * a, -0.4)),
        P("torque_ripple", "shaft",
          lambda a, *_: loads.Ripple([0.08 * a, 0.05 * a, 0.03 * a], [6.0, 12.0, 18.0],
          [0.2, 1.4, 2.9])),
        P("backlash", "shaft", lambda a, *_: loads.LooseInertia("J1", 0.0016, 0.05 * a, 0.2, 0.5)),
        P("inertia_error", "slider", lambda a, *_: loads.WrongInertia("m3", 0.25 * a)),
        P("actuator_gain", "actuator:T", lambda a, *_: actuators.Gain(0.15 * a)),
        P("actuator_offset", "actuator:T",
          lambda a, *_: actuators.Offset(0.08 * a), (("constant_load", "shaft"),)),
        P("actuator_saturation", "actuator:T", lambda a, *_: actuators.SoftSaturation(0.8 / a)),
        P("actuator_dead_zone", "actuator:T", lambda a, *_: actuators.RoundedDeadZone(0.08 * a)),
        P("actuator_asymmetry", "actuator:T", lambda a, *_: actuators.UnequalSides(min(0.15 * a, 0.5), 0.02)),
        P("actuator_lag", "actuator:T", lambda a, *_: actuators.TwoPoleLag(0.01 * a)),
        P("actuator_rate_limit", "actuator:T", lambda a, *_: actuators.SlowAmplifier(5.0 / a)),
        P("input_delay", "actuator:T", lambda a, *_: actuators.Transport(0.0073 * a)),
        P("sensor_offset", "sensor:theta", lambda a, *_: sensors.Bias(0.12 * a)),
        P("sensor_gain", "sensor:omega", lambda a, *_: sensors.ScaleError(0.08 * a)),
        P("sensor_delay", "sensor:omega", lambda a, *_: sensors.Latency(0.0075 * a)),
        P("sensor_lag", "sensor:omega", lambda a, *_: sensors.LowPass(0.025 * a)),
        P("drift", "shaft", lambda a, plan, _: changing.WarmingBearing(0.008 * a, 8.0, plan.begin)),
        P("scatter", "shaft", changing.scattered_damping(0.005, -0.006)),
        P("centrifugal", "shaft", lambda a, *_: foreign.Centrifugal(8e-4 * a, 3.0, 0.7)),
        P("flexible_transmission", "shaft",
          lambda a, *_: loads.Resonator("J1", min(0.0015 * a, 0.0025), 9.0, 0.01)),
        P("heated_motor", "actuator:T",
          lambda a, *_: foreign.HeatedMotor(1.5 * a, 0.5), (("drift", "actuator:T"),)),
        P("sticky_valve", "actuator:T", lambda a, *_: foreign.StickyValve(0.08 * a)),
        P("missed_counts", "sensor:theta", lambda a, *_: foreign.MissedCounts(0.08 * a, 12.0)),
    )  # fmt: skip


@dataclass(frozen=True)
class CamDrive(Machine):
    """Direct-current motor that turns a grooved cam, with a follower that moves vertically on a spring.

    The groove lifts the follower by `lift` with a share `skew` of second harmonic. The operating point is the
    mass m of the follower (kg) and the supply V (V). The motor gets the share `duty` of the supply.
    """

    J: float = 0.004  # inertia of the shaft, kg m^2
    b: float = 0.01  # damping of the shaft, N m s/rad
    kt: float = 0.26  # torque constant of the motor, N m/A
    R: float = 0.95  # resistance of the motor, ohm
    m_0: float = 0.35  # mass of the follower in addition to m, kg
    k_s: float = 150.0  # stiffness of the spring, N/m
    y_0: float = 0.04  # compression of the spring at the lowest position, m
    lift: float = 0.04  # amplitude of the groove, m
    skew: float = 0.15  # share of the second harmonic in the groove
    gain: float = 0.03  # gain of the controller of the speed, s/rad
    fastest: float = 25.0  # set point of the speed at the reference 1, rad/s

    name = "cam_drive"
    input = "duty"
    periods = (5e-4, 0.001)
    duration = 2.0
    runs = (12, 16)
    range = Range(0.75, 2.0)
    rest = -0.5, 0.5
    sensors = (Sensor("theta", 0, False, 2.0 * np.pi / 10_000, 1.5e-3), Sensor("omega", 0, True, 0.0, 0.08))
    optional = ("omega",)
    factors = {"m": (0.4, 0.9, 1.5), "V": (9.0, 13.0)}  # noqa: RUF012
    friction = {"b": "shaft"}  # noqa: RUF012
    doubtful = {"m_0": ("inertia_error",), "k_s": ("linear_spring", "nonlinear_spring")}  # noqa: RUF012

    def regulated(self, reference: Array, slope: Array, q: Array, v: Array, c: Conditions) -> Array:
        speed = self.fastest * reference
        u = self.kt * speed / c["V"] + self.gain * (speed - v[0])
        return np.asarray(np.clip(u, -1.0, 1.0))

    def groove(self, theta: Array) -> tuple[Array, Array, Array]:
        """Return the height of the follower at theta (n,), rad, and two derivatives by the angle."""
        wave = np.exp(1j * theta)
        second = self.skew * wave * wave
        half = 0.5 * self.lift
        return (
            half * (1.0 - wave + second - self.skew).real,
            half * (wave - 2.0 * second).imag,
            (half * (wave - 4.0 * second).real),
        )

    def _inertia(self, slope: Array, c: Conditions) -> Array:
        return np.asarray(self.J + (c["m"] + self.m_0) * slope**2)

    def rates(self, q: Array, v: Array, u: Array, c: Conditions) -> Array:
        y, slope, bend = self.groove(q[0])
        mass, omega = c["m"] + self.m_0, v[0]
        current = (u * c["V"] - self.kt * omega) / self.R
        force = mass * (GRAVITY + bend * omega**2) + self.k_s * (y + self.y_0)
        torque = self.kt * current - self.b * omega - slope * force
        return np.asarray(torque / self._inertia(slope, c))[None]

    def port(self, name: str, q: Array, v: Array, c: Conditions) -> Port:
        y, slope, _ = self.groove(q[0])
        mobility = 1.0 / self._inertia(slope, c)
        if name == "shaft":
            return Port(q[0], v[0], -mobility[None], mobility)
        return Port(y, slope * v[0], -(slope * mobility)[None], slope * slope * mobility)

    plantable = (
        P("viscous_friction", "follower", lambda a, *_: friction.EyringDrag(25.0 * a, 1.0), local=True),
        P("coulomb_friction", "follower", lambda a, *_: friction.Coulomb(4.0 * a), local=True),
        P("coulomb_friction", "shaft", lambda a, *_: friction.Coulomb(0.1 * a), local=True),
        P("stribeck_friction", "shaft", lambda a, *_: friction.TustinFriction(0.06 * a, 0.2 * a, 2.0)),
        P("quadratic_drag", "shaft", lambda a, *_: friction.Windage(4e-4 * a, 2.0), local=True),
        P("position_dependent_friction", "shaft", lambda a, *_: friction.RubbingArc(0.2 * a, 2.0)),
        P("hysteresis", "follower", lambda a, *_: friction.MaxwellSlip(8.0 * a, 0.012)),
        P("linear_spring", "follower", lambda a, *_: loads.RubberSpring(250.0 * a, 0.0, 0.2), local=True),
        P("nonlinear_spring", "follower",
          lambda a, *_: loads.OneSidedSpring(700.0 * a, 0.015, 1.0, 1.7, 0.02)),
        P("end_stop", "follower", lambda a, *_: loads.Bumper(3e4 * a, 0.4, -1.0, 0.032)),
        P("constant_load", "follower",
          lambda a, *_: loads.ConstantLoad(4.0 * a), (("gravity_load", "follower"),)),
        P("gravity_load", "shaft", lambda a, *_: loads.Unbalance(0.12 * a, 0.8)),
        P("torque_ripple", "shaft", lambda a, *_: loads.Ripple([0.15 * a, 0.1 * a], [8.0, 24.0], [0.2, 1.4])),
        P("backlash", "shaft", lambda a, *_: loads.LooseInertia("J", 0.002, 0.08 * a, 0.2, 0.5)),
        P("inertia_error", "follower", lambda a, *_: loads.WrongInertia("m_0", 0.5 * a)),
        P("actuator_gain", "actuator:duty", lambda a, *_: actuators.Gain(0.12 * a)),
        P("actuator_offset", "actuator:duty", lambda a, *_: actuators.Offset(0.04 * a)),
        P("actuator_saturation", "actuator:duty", lambda a, *_: actuators.SoftSaturation(0.8 / a)),
        P("actuator_dead_zone", "actuator:duty", lambda a, *_: actuators.RoundedDeadZone(0.06 * a)),
        P("actuator_lag", "actuator:duty", lambda a, *_: actuators.TwoPoleLag(0.016 * a)),
        P("actuator_rate_limit", "actuator:duty", lambda a, *_: actuators.SlowAmplifier(2.0 / a)),
        P("input_delay", "actuator:duty", lambda a, *_: actuators.Transport(0.0103 * a)),
        P("sensor_offset", "sensor:theta", lambda a, *_: sensors.Bias(0.1 * a)),
        P("sensor_gain", "sensor:omega", lambda a, *_: sensors.ScaleError(0.08 * a)),
        P("sensor_delay", "sensor:omega", lambda a, *_: sensors.Latency(0.0075 * a)),
        P("sensor_lag", "sensor:omega", lambda a, *_: sensors.LowPass(0.025 * a)),
        P("drift", "shaft", lambda a, plan, _: changing.WarmingBearing(0.012 * a, 12.0, plan.begin)),
        P("scatter", "shaft", changing.scattered_damping(0.006, -0.009)),
        P("centrifugal", "shaft", lambda a, *_: foreign.Centrifugal(8e-4 * a, 5.0, 0.7)),
        P("heated_friction", "follower",
          lambda a, plan, _: foreign.HeatedFriction((2.0 + 5.0 * plan.conditions["m"]) * a, 3.0, 3.0),
          (("coulomb_friction", "follower"), ("drift", "follower"))),
        P("sticky_valve", "actuator:duty", lambda a, *_: foreign.StickyValve(0.06 * a)),
        P("heated_motor", "actuator:duty", lambda a, *_: foreign.HeatedMotor(0.5 * a, 0.5),
          (("drift", "actuator:duty"), ("actuator_gain", "actuator:duty"))),
    )  # fmt: skip
