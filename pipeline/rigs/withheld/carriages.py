"""Machines that move along a line: a hoist, and a linear axis with a belt."""

from dataclasses import dataclass

import numpy as np

from pipeline.rigs.withheld.effects import actuators, changing, foreign, friction, loads, sensors
from pipeline.rigs.withheld.effects.effect import Plantable as P
from pipeline.rigs.withheld.effects.effect import Port
from pipeline.rigs.withheld.machine import GRAVITY, Conditions, Machine, Range, Sensor
from unmodelled.base.arrays import Array


@dataclass(frozen=True)
class Hoist(Machine):
    """Drum with position control that lifts a payload m (kg), the operating point; reduced to the rope."""

    M: float = 8.5  # mass of drum and balanced cabin, kg
    kf: float = 12.0  # force constant of the drive, N/V
    b: float = 31.0  # damping, N s/m
    stiffness: float = 160.0  # proportional gain of the controller, V/m
    damping: float = 18.0  # derivative gain of the controller, V s/m
    supply: float = 12.0  # largest voltage of the controller, V

    name = "hoist"
    input = "u"
    duration = 3.0
    runs = (9, 12)
    range = Range(0.16, 1.6, 0.5)
    rest = 0.495, 0.505
    sensors = (Sensor("x", 0, False, 5e-5, 1e-4), Sensor("v", 0, True, 0.0, 0.004))
    optional = ("v",)
    factors = {"m": (0.5, 1.5, 3.0)}  # noqa: RUF012
    friction = {"b": "rail"}  # noqa: RUF012
    doubtful = {"M": ("inertia_error",)}  # noqa: RUF012

    def command(self, reference: Array, slope: Array, q: Array, v: Array, c: Conditions) -> Array:
        hold = (c["m"] * GRAVITY + self.b * slope) / self.kf
        u = hold + self.stiffness * (reference - q[0]) + self.damping * (slope - v[0])
        return np.asarray(np.clip(u, -self.supply, self.supply))

    def rates(self, q: Array, v: Array, u: Array, c: Conditions) -> Array:
        return (self.kf * u - self.b * v - c["m"] * GRAVITY) / (self.M + c["m"])

    def port(self, name: str, q: Array, v: Array, c: Conditions) -> Port:
        mobility = 1.0 / (self.M + c["m"])
        return Port(q[0], v[0], -mobility[None], mobility)

    def load(self, name: str, u: Array) -> Array:
        return np.asarray(self.kf * u)

    plantable = (
        P("coulomb_friction", "rail", lambda a, *_: friction.Coulomb(5.0 * a), local=True),
        P("stribeck_friction", "rail",
          lambda a, *_: friction.LorentzFriction(3.0 * a, 9.0 * a, 0.05), local=True),
        P("load_friction", "rail", lambda a, *_: friction.GearFriction(min(0.12 * a, 0.4), 4.0), local=True),
        P("quadratic_drag", "rail", lambda a, *_: friction.Windage(20.0 * a, 0.05), local=True),
        P("position_dependent_friction", "rail",
          lambda a, *_: friction.TightSpot(14.0 * a, 0.52, 0.04), local=True),
        P("hysteresis", "rail", lambda a, *_: friction.MaxwellSlip(6.0 * a, 0.02)),
        P("linear_spring", "rail", lambda a, *_: loads.RubberSpring(40.0 * a, 0.5, 0.5)),
        P("nonlinear_spring", "rail",
          lambda a, *_: loads.PlaySpring(60.0 * a, 4e3 * a, 0.5, 0.03), local=True),
        P("end_stop", "rail", lambda a, *_: loads.Bumper(2e4 * a, 0.5, 0.4, 0.6)),
        P("constant_load", "rail", lambda a, *_: loads.ConstantLoad(6.0 * a),
          (("actuator_offset", "actuator:u"), ("gravity_load", "rail")), local=True),
        P("torque_ripple", "rail",
          lambda a, *_: loads.Ripple([5.0 * a, 2.0 * a, 1.0 * a], [60.0, 120.0, 180.0],
          [0.3, 1.1, 2.6])),
        P("backlash", "rail", lambda a, *_: loads.LooseInertia("M", 2.5, 0.003 * a, 0.25, 0.02)),
        P("inertia_error", "rail", lambda a, *_: loads.WrongInertia("M", 1.8 * a)),
        P("actuator_offset", "actuator:u", lambda a, *_: actuators.Offset(0.5 * a),
          (("constant_load", "rail"), ("gravity_load", "rail"))),
        P("actuator_saturation", "actuator:u", lambda a, *_: actuators.SoftSaturation(11.0 / a)),
        P("actuator_dead_zone", "actuator:u", lambda a, *_: actuators.RoundedDeadZone(0.6 * a)),
        P("actuator_lag", "actuator:u", lambda a, *_: actuators.TwoPoleLag(0.008 * a)),
        P("input_delay", "actuator:u", lambda a, *_: actuators.Transport(0.0073 * a)),
        P("sensor_gain", "sensor:v", lambda a, *_: sensors.ScaleError(0.08 * a)),
        P("sensor_offset", "sensor:v", lambda a, *_: sensors.Bias(0.025 * a)),
        P("sensor_delay", "sensor:v", lambda a, *_: sensors.Latency(0.006 * a)),
        P("sensor_lag", "sensor:v", lambda a, *_: sensors.LowPass(0.02 * a)),
        P("drift", "actuator:u", changing.fading_drive(0.2, 15.0)),
        P("scatter", "rail", changing.scattered_damping(14.0, -25.0)),
        P("heated_friction", "rail",
          lambda a, plan, _: foreign.HeatedFriction((2.0 + 4.0 * plan.conditions["m"]) * a, 2.0, 3.0),
          (("coulomb_friction", "rail"), ("drift", "rail"))),
        P("floor_vibration", "rail", foreign.floor_vibration(7.0, 10.0)),
        P("sticky_valve", "actuator:u", lambda a, *_: foreign.StickyValve(0.8 * a)),
        P("flexible_transmission", "rail", lambda a, *_: loads.Resonator("M", min(1.8 * a, 6.0), 8.0, 0.02)),
    )  # fmt: skip


@dataclass(frozen=True)
class BeltAxis(Machine):
    """Motor that moves a carriage through a toothed belt, with position control, reduced to the belt."""

    m_m: float = 1.6  # mass of the motor, kg
    m_c: float = 4.2  # mass of the carriage, kg
    b_m: float = 7.0  # damping of the motor, N s/m
    b_c: float = 14.0  # damping of the carriage, N s/m
    k_b: float = 2.0e4  # stiffness of the belt, N/m
    c_b: float = 40.0  # damping of the belt, N s/m
    kf: float = 10.0  # force constant of the drive, N/A
    stiffness: float = 320.0  # proportional gain of the controller, A/m
    damping: float = 22.0  # derivative gain of the controller, A s/m
    supply: float = 15.0  # largest current of the controller, A

    name = "belt_axis"
    input = "i"
    duration = 2.5
    runs = (6, 8, 10)
    range = Range(0.13, 2.0)
    sensors = (
        Sensor("x_m", 0, False, 2e-5, 2e-5),
        Sensor("x_c", 1, False, 1e-5, 2e-5),
        Sensor("v_m", 0, True, 0.0, 0.006),
        Sensor("v_c", 1, True, 0.0, 0.006),
    )
    optional = ("v_c",)
    groups = ("A", "B")
    friction = {"b_m": "motor", "b_c": "rail"}  # noqa: RUF012
    doubtful = {"m_m": ("inertia_error",), "m_c": ("inertia_error",)}  # noqa: RUF012

    def start(self, runs: int, rng: np.random.Generator) -> Array:
        return np.tile(rng.uniform(-0.003, 0.003, runs), (2, 1))

    def command(self, reference: Array, slope: Array, q: Array, v: Array, c: Conditions) -> Array:
        u = self.stiffness * (reference - q[0]) + self.damping * (slope - v[0])
        u = u + (self.b_m + self.b_c) / self.kf * slope
        return np.asarray(np.clip(u, -self.supply, self.supply))

    def rates(self, q: Array, v: Array, u: Array, c: Conditions) -> Array:
        pull = self.k_b * (q[0] - q[1]) + self.c_b * (v[0] - v[1])
        motor = (self.kf * u - self.b_m * v[0] - pull) / self.m_m
        return np.stack([motor, (pull - self.b_c * v[1]) / self.m_c])

    def port(self, name: str, q: Array, v: Array, c: Conditions) -> Port:
        row, mass = (0, self.m_m) if name == "motor" else (1, self.m_c)
        response = np.zeros_like(v)
        response[row] = -1.0 / mass
        return Port(q[row], v[row], response, -response[row])

    def load(self, name: str, u: Array) -> Array:
        return np.asarray(self.kf * u if name == "motor" else 0.0 * u)

    plantable = (
        P("viscous_friction", "rail", lambda a, *_: friction.EyringDrag(10.0 * a, 1.5), local=True),
        P("viscous_friction", "motor", lambda a, *_: friction.EyringDrag(10.0 * a, 1.5)),
        P("coulomb_friction", "rail", lambda a, *_: friction.Coulomb(6.0 * a), local=True),
        P("coulomb_friction", "motor", lambda a, *_: friction.ArctanFriction(6.0 * a, 0.002), local=True),
        P("stribeck_friction", "rail", lambda a, *_: friction.TustinFriction(4.0 * a, 10.0 * a, 0.06)),
        P("load_friction", "motor", lambda a, *_: friction.GearFriction(min(0.15 * a, 0.5), 2.0)),
        P("quadratic_drag", "rail", lambda a, *_: friction.Windage(10.0 * a, 0.05)),
        P("position_dependent_friction", "rail", lambda a, *_: friction.TightSpot(16.0 * a, 0.03, 0.03)),
        P("hysteresis", "rail", lambda a, *_: friction.MaxwellSlip(8.0 * a, 0.015)),
        P("linear_spring", "rail", lambda a, *_: loads.RubberSpring(70.0 * a, 0.0, 0.4), local=True),
        P("nonlinear_spring", "rail", lambda a, *_: loads.PlaySpring(120.0 * a, 1e4 * a, 0.0, 0.03)),
        P("end_stop", "rail", lambda a, *_: loads.Bumper(2.5e3 * a, 0.5, -0.08, 0.07)),
        P("constant_load", "rail",
          lambda a, *_: loads.ConstantLoad(5.0 * a), (("gravity_load", "rail"),), local=True),
        P("torque_ripple", "motor",
          lambda a, *_: loads.Ripple([5.0 * a, 2.5 * a, 1.5 * a], [52.0, 104.0, 312.0],
          [0.9, 2.2, 0.1])),
        P("backlash", "motor", lambda a, *_: loads.LooseInertia("m_m", 0.8, 0.003 * a, 0.15, 0.06)),
        P("inertia_error", "rail", lambda a, *_: loads.WrongInertia("m_c", 0.6 * a)),
        P("actuator_gain", "actuator:i", lambda a, *_: actuators.Gain(-min(0.12 * a, 0.6))),
        P("actuator_offset", "actuator:i",
          lambda a, *_: actuators.Offset(0.5 * a), (("constant_load", "motor"),)),
        P("actuator_saturation", "actuator:i", lambda a, *_: actuators.SoftSaturation(10.0 / a)),
        P("actuator_dead_zone", "actuator:i", lambda a, *_: actuators.RoundedDeadZone(0.5 * a)),
        P("actuator_asymmetry", "actuator:i", lambda a, *_: actuators.UnequalSides(min(0.12 * a, 0.5), 0.2)),
        P("actuator_lag", "actuator:i", lambda a, *_: actuators.TwoPoleLag(0.006 * a)),
        P("input_delay", "actuator:i", lambda a, *_: actuators.Transport(0.0047 * a)),
        P("sensor_gain", "sensor:x_c", lambda a, *_: sensors.ScaleError(0.01 * a)),
        P("sensor_offset", "sensor:x_c", lambda a, *_: sensors.Bias(8e-4 * a)),
        P("sensor_delay", "sensor:v_m", lambda a, *_: sensors.Latency(0.0045 * a)),
        P("sensor_lag", "sensor:v_m", lambda a, *_: sensors.LowPass(0.015 * a)),
        P("drift", "actuator:i", changing.fading_drive(0.25, 12.0)),
        P("drift", "rail", lambda a, plan, _: changing.WarmingBearing(18.0 * a, 10.0, plan.begin)),
        P("scatter", "rail", changing.scattered_damping(8.0, -12.0)),
        P("flexible_transmission", "rail",
          lambda a, *_: loads.Resonator("m_c", min(1.0 * a, 3.0), 8.0, 0.02)),
        P("sticky_valve", "actuator:i", lambda a, *_: foreign.StickyValve(0.8 * a)),
        P("heated_motor", "actuator:i", lambda a, *_: foreign.HeatedMotor(0.012 * a, 0.6),
          (("drift", "actuator:i"), ("actuator_gain", "actuator:i"))),
        P("floor_vibration", "rail", foreign.floor_vibration(8.0, 11.0)),
    )  # fmt: skip
