"""A slider-crank with speed control; the crank turns in a vertical plane, the slider moves horizontally."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

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
from pipeline.rigs.withheld.effects.effect import Port
from pipeline.rigs.withheld.machine import Conditions, Machine, Range, Sensor

_GRAVITY = 9.81
_COUNT = 2.0 * np.pi / 8192


class Linkage(NamedTuple):
    """First and second derivatives of positions of the linkage by the angle of the crank.

    Attributes:
        slider: derivatives of the slider's position, m/rad and m/rad^2, each of shape (n,).
        rod_x: derivatives of the horizontal position of the rod's centre, m/rad and m/rad^2, each of shape
            (n,).
        rod_y: derivatives of the vertical position of the rod's centre, m/rad and m/rad^2, each of shape
            (n,).
        rod_angle: derivatives of the rod's angle, 1 and 1/rad, each of shape (n,).
    """

    slider: tuple[Array, Array]
    rod_x: tuple[Array, Array]
    rod_y: tuple[Array, Array]
    rod_angle: tuple[Array, Array]


@dataclass(frozen=True)
class SliderCrank(Machine):
    """Constants of the slider-crank.

    Attributes:
        m1: mass of the crank, kg.
        m2: mass of the rod, kg.
        m3: mass of the slider, kg.
        l1: length of the crank, m.
        l2: length of the rod, m.
        J1: inertia of motor and crank, kg m^2.
        B_m: damping of the shaft, N m s/rad.
        gain: gain of the speed controller, N m s/rad.
        torque: largest torque of the controller, N m.
    """

    m1: float = 0.23
    m2: float = 0.35
    m3: float = 0.77
    l1: float = 0.05
    l2: float = 0.29
    J1: float = 0.0034
    B_m: float = 0.007
    gain: float = 0.12
    torque: float = 5.0

    name = "slider_crank"
    input = "T"
    periods = (5e-4, 0.001)
    duration = 2.0
    runs = (8, 10)
    range = Range(20.0, 2.5)
    sensors = (Sensor("theta", 0, False, _COUNT, 1.5e-3, wraps=True), Sensor("omega", 0, True, 0.0, 0.08))
    optional = ("omega",)
    groups = ("first", "second")
    friction = {"B_m": "shaft"}  # noqa: RUF012
    doubtful = {"m3": ("inertia_error",), "m2": ("inertia_error",)}  # noqa: RUF012

    def start(self, runs: int, rng: np.random.Generator) -> Array:
        return rng.uniform(0.0, 2.0 * np.pi, (1, runs))

    def command(self, reference: Array, slope: Array, q: Array, v: Array, c: Conditions) -> Array:
        return np.asarray(np.clip(self.gain * (reference - v[0]), -self.torque, self.torque))

    def linkage(self, theta: Array) -> Linkage:
        """Solve the closed loop of the linkage.

        Takes theta (n,) in rad.
        """
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
        weight = _GRAVITY * (0.5 * self.m1 * self.l1 * np.cos(q[0]) + self.m2 * at.rod_y[0])
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
        P("linear_spring", "slider", lambda a, *_: elastic.RubberSpring(40.0 * a, 0.02, 0.2), local=True),
        P("nonlinear_spring", "slider",
          lambda a, *_: elastic.OneSidedSpring(120.0 * a, 0.04, 1.0, 2.2, 0.05)),
        P("end_stop", "slider", lambda a, *_: elastic.Bumper(1.5e4 * a, 0.3, -1.0, 0.09)),
        P("constant_load", "slider",
          lambda a, *_: loads.ConstantLoad(2.0 * a), (("gravity_load", "slider"),)),
        P("gravity_load", "shaft", lambda a, *_: loads.Unbalance(0.12 * a, -0.4)),
        P("torque_ripple", "shaft",
          lambda a, *_: loads.Ripple([0.08 * a, 0.05 * a, 0.03 * a], [6.0, 12.0, 18.0],
          [0.2, 1.4, 2.9])),
        P("backlash", "shaft", lambda a, *_: play.LooseInertia("J1", 0.0016, 0.05 * a, 0.2, 0.5)),
        P("inertia_error", "slider", lambda a, *_: loads.WrongInertia("m3", 0.25 * a)),
        P("actuator_gain", "actuator:T", lambda a, *_: actuators.Gain(0.15 * a)),
        P("actuator_offset", "actuator:T",
          lambda a, *_: actuators.Offset(0.08 * a), (("constant_load", "shaft"),)),
        P("actuator_saturation", "actuator:T", lambda a, *_: actuators.SoftSaturation(0.8 / a)),
        P("actuator_dead_zone", "actuator:T", lambda a, *_: actuators.RoundedDeadZone(0.08 * a)),
        P("actuator_asymmetry", "actuator:T",
          lambda a, *_: actuators.UnequalSides(min(0.15 * a, 0.5), 0.02)),
        P("actuator_lag", "actuator:T", lambda a, *_: actuators.TwoPoleLag(0.01 * a)),
        P("actuator_rate_limit", "actuator:T", lambda a, *_: actuators.SlowAmplifier(5.0 / a)),
        P("input_delay", "actuator:T", lambda a, *_: actuators.Transport(0.0073 * a)),
        P("sensor_offset", "sensor:theta", lambda a, *_: sensors.Bias(0.12 * a)),
        P("sensor_gain", "sensor:omega", lambda a, *_: sensors.ScaleError(0.08 * a)),
        P("sensor_delay", "sensor:omega", lambda a, *_: sensors.Latency(0.0075 * a)),
        P("sensor_lag", "sensor:omega", lambda a, *_: sensors.LowPass(0.025 * a)),
        P("drift", "shaft", lambda a, plan, _: changing.WarmingBearing(0.008 * a, 8.0, plan.begin)),
        P("scatter", "shaft",
          lambda a, plan, rng: changing.scattered_damping(0.005 * a, -0.006, plan.runs, rng)),
        P("centrifugal", "shaft", lambda a, *_: foreign.Centrifugal(8e-4 * a, 3.0, 0.7)),
        P("flexible_transmission", "shaft",
          lambda a, *_: play.Resonator("J1", min(0.0015 * a, 0.0025), 9.0, 0.01)),
        P("heated_motor", "actuator:T",
          lambda a, *_: foreign.HeatedMotor(1.5 * a, 0.5), (("drift", "actuator:T"),)),
        P("sticky_valve", "actuator:T", lambda a, *_: foreign.StickyValve(0.08 * a)),
        P("missed_counts", "sensor:theta", lambda a, *_: foreign.MissedCounts(0.08 * a, 12.0)),
    )  # fmt: skip
