"""Machines that move along a line: a ball screw, a magnet, a chain of masses, a hydraulic cylinder."""

from dataclasses import dataclass

import numpy as np

from pipeline.rigs.withheld.effects import actuators, changing, flows, foreign, friction, loads, sensors
from pipeline.rigs.withheld.effects.effect import Plantable as P
from pipeline.rigs.withheld.machine import Conditions, Range, Sensor
from pipeline.rigs.withheld.mechanism import Mechanism
from unmodelled.base.arrays import Array


@dataclass(frozen=True)
class BallScrew(Mechanism):
    """Axis with a ball screw and position control; the payload m (kg) of the table is the operating point."""

    J: float = 5e-4  # moment of inertia of motor and screw, kg m^2
    b: float = 2e-3  # damping of motor and screw, N m s/rad
    m_t: float = 12.0  # mass of the table, kg
    b_t: float = 90.0  # damping of the table, N s/m
    n: float = 0.02 / (2.0 * np.pi)  # travel of the table per angle of the screw, m/rad
    kt: float = 0.45  # torque constant of the motor, N m/A
    stiffness: float = 1.5  # proportional gain of the controller, A/rad
    damping: float = 0.06  # derivative gain of the controller, A s/rad

    limits = -16.0, 16.0
    name = "ball_screw"
    input = "i"
    duration = 3.0
    runs = (9, 12)
    range = Range(22.0, 1.5)
    rest = -1.0, 1.0
    sensors = (Sensor("theta", 0, False, 2.0 * np.pi / 4096, 5e-4), Sensor("omega", 0, True, 0.0, 1.0))
    optional = ("omega",)
    factors = {"m": (0.0, 15.0, 40.0)}  # noqa: RUF012
    friction = {"b": "screw", "b_t": "table"}  # noqa: RUF012
    doubtful = {"J": ("inertia_error",), "kt": ("actuator_gain",)}  # noqa: RUF012

    @property
    def ports(self) -> dict[str, tuple[float, ...]]:
        """Position of screw and table per angle of the screw."""
        return {"screw": (1.0,), "table": (self.n,)}

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
        P("linear_spring", "table", lambda a, *_: loads.RubberSpring(1500.0 * a, 0.0, 0.1),
          (("linear_spring", "screw"),)),
        P("end_stop", "table", lambda a, *_: loads.Bumper(2e5 * a, 0.4, -0.035, 0.03)),
        P("torque_ripple", "screw", lambda a, *_: loads.Ripple([0.12 * a, 0.06 * a], [1.0, 4.0], [0.5, 1.2])),
        P("backlash", "screw", lambda a, *_: loads.LooseInertia("J", 1e-4, 0.15 * a, 0.2, 0.5)),
        P("actuator_offset", "actuator:i", lambda a, *_: actuators.Offset(0.25 * a),
          (("constant_load", "screw"), ("constant_load", "table"))),
        P("actuator_asymmetry", "actuator:i", lambda a, *_: actuators.UnequalSides(min(0.12 * a, 0.5), 0.2)),
        P("actuator_rate_limit", "actuator:i", lambda a, *_: actuators.SlowAmplifier(1500.0 / a)),
        P("sensor_delay", "sensor:omega", lambda a, *_: sensors.Latency(0.006 * a)),
        P("drift", "actuator:i", changing.fading_drive(0.2, 12.0)),
        P("heated_friction", "table",
          lambda a, plan, _: foreign.HeatedFriction((20.0 + 1.5 * plan.conditions["m"]) * a, 12.0, 3.0),
          (("coulomb_friction", "table"), ("drift", "table"))),
    )  # fmt: skip


@dataclass(frozen=True)
class Magnet(Mechanism):
    """Stage that an electromagnet pulls against a spring: the force falls with the square of the gap.

    At the position 0 the spring is relaxed.
    """

    m: float = 0.8  # mass of the stage, kg
    b: float = 6.0  # damping of the guide, N s/m
    k_s: float = 1000.0  # stiffness of the spring, N/m
    k_m: float = 2e-5  # constant of the magnet, N m^2/A^2
    gap: float = 0.01  # gap of the magnet at the position 0, m
    stiffness: float = 60.0  # proportional gain of the controller, A/m
    damping: float = 0.5  # derivative gain of the controller, A s/m

    limits = 0.0, 4.0
    ports = {"stage": (1.0,)}  # noqa: RUF012
    name = "magnet"
    input = "i"
    duration = 2.0
    runs = (9, 12)
    range = Range(6e-4, 3.5, 1e-3)
    rest = 9.5e-4, 1.05e-3
    sensors = (Sensor("x", 0, False, 4e-7, 1e-6), Sensor("v", 0, True, 0.0, 2e-4))
    optional = ("v",)
    friction = {"b": "stage"}  # noqa: RUF012
    doubtful = {"m": ("inertia_error",)}  # noqa: RUF012

    def held(self, reference: Array, slope: Array, c: Conditions) -> Array:
        force = np.maximum(self.k_s * reference + self.b * slope, 0.0)
        return np.asarray((self.gap - reference) * np.sqrt(force / self.k_m))

    def inertia(self, q: Array, c: Conditions) -> tuple[tuple[float, ...], ...]:
        return ((self.m,),)

    def efforts(self, q: Array, v: Array, u: Array, c: Conditions) -> tuple[Array, ...]:
        return (self.k_m * (u / (self.gap - q[0])) ** 2 - self.b * v[0] - self.k_s * q[0],)

    def load(self, name: str, u: Array) -> Array:
        return self.k_m * (u / self.gap) ** 2

    plantable = (
        P("coulomb_friction", "stage", lambda a, *_: friction.Coulomb(0.06 * a)),
        P("viscous_friction", "stage", lambda a, *_: friction.EyringDrag(4.0 * a, 0.03)),
        P("hysteresis", "stage", lambda a, *_: friction.MaxwellSlip(0.12 * a, 4e-4)),
        P("nonlinear_spring", "stage", lambda a, *_: loads.OneSidedSpring(300.0 * a, 1e-3, 1.0, 1.7, 5e-4)),
        P("end_stop", "stage", lambda a, *_: loads.Bumper(7e4 * a, 2.0, 2e-4, 1.4e-3)),
        P("constant_load", "stage", lambda a, *_: loads.ConstantLoad(0.12 * a)),
        P("inertia_error", "stage", lambda a, *_: loads.WrongInertia("m", 0.15 * a)),
        P("actuator_offset", "actuator:i", lambda a, *_: actuators.Offset(0.06 * a)),
        P("actuator_saturation", "actuator:i", lambda a, *_: actuators.SoftSaturation(3.0 / a)),
        P("actuator_lag", "actuator:i", lambda a, *_: actuators.TwoPoleLag(0.004 * a)),
        P("sensor_gain", "sensor:v", lambda a, *_: sensors.ScaleError(0.06 * a)),
        P("sensor_offset", "sensor:x", lambda a, *_: sensors.Bias(3e-5 * a)),
        P("drift", "stage", lambda a, plan, _: changing.WarmingBearing(5.0 * a, 8.0, plan.begin)),
        P("floor_vibration", "stage", foreign.floor_vibration(0.15, 8.0)),
    )  # fmt: skip


@dataclass(frozen=True)
class MassChain(Mechanism):
    """Three masses in a row, with springs and dampers between them; a force acts on the first one.

    The first spring is fixed to the frame.
    """

    m1: float = 1.5  # first mass, kg
    m2: float = 1.0  # second mass, kg
    m3: float = 0.8  # third mass, kg
    k1: float = 900.0  # stiffness between the frame and the first mass, N/m
    k2: float = 700.0  # stiffness between first and second mass, N/m
    k3: float = 500.0  # stiffness between second and third mass, N/m
    b1: float = 2.5  # damping between the frame and the first mass, N s/m
    b2: float = 1.5  # damping between first and second mass, N s/m
    b3: float = 1.2  # damping between second and third mass, N s/m
    stiffness: float = 200.0  # proportional gain of the controller, N/m
    damping: float = 8.0  # derivative gain of the controller, N s/m

    limits = -40.0, 40.0
    ports = {"first": (1.0, 0.0, 0.0), "second": (0.0, 1.0, 0.0), "third": (0.0, 0.0, 1.0)}  # noqa: RUF012
    name = "mass_chain"
    input = "F"
    periods = (0.001, 0.002, 0.004)
    duration = 4.0
    runs = (6, 8, 10)
    range = Range(0.015, 3.5)
    sensors = (
        Sensor("x1", 0, False, 1e-5, 2e-5),
        Sensor("x2", 1, False, 1e-5, 2e-5),
        Sensor("x3", 2, False, 1e-5, 2e-5),
        Sensor("v1", 0, True, 0.0, 0.002),
        Sensor("v2", 1, True, 0.0, 0.002),
        Sensor("v3", 2, True, 0.0, 0.002),
    )
    optional = ("v1", "v2", "v3")
    friction = {"b1": "first"}  # noqa: RUF012
    doubtful = {"m2": ("inertia_error",), "k1": ("linear_spring",)}  # noqa: RUF012

    def start(self, runs: int, rng: np.random.Generator) -> Array:
        return np.zeros((3, runs))

    def held(self, reference: Array, slope: Array, c: Conditions) -> Array:
        return self.k1 * reference + self.b1 * slope

    def inertia(self, q: Array, c: Conditions) -> tuple[tuple[float, ...], ...]:
        return (self.m1, 0.0, 0.0), (0.0, self.m2, 0.0), (0.0, 0.0, self.m3)

    def efforts(self, q: Array, v: Array, u: Array, c: Conditions) -> tuple[Array, ...]:
        near = self.k2 * (q[0] - q[1]) + self.b2 * (v[0] - v[1])
        far = self.k3 * (q[1] - q[2]) + self.b3 * (v[1] - v[2])
        return u - self.k1 * q[0] - self.b1 * v[0] - near, near - far, far

    def load(self, name: str, u: Array) -> Array:
        return np.asarray(u if name == "first" else 0.0 * u)

    plantable = (
        P("coulomb_friction", "third", lambda a, *_: friction.Coulomb(0.4 * a)),
        P("coulomb_friction", "first", lambda a, *_: friction.ArctanFriction(1.0 * a, 0.004)),
        P("stribeck_friction", "second", lambda a, *_: friction.LorentzFriction(0.3 * a, 0.9 * a, 0.03)),
        P("quadratic_drag", "third", lambda a, *_: friction.Windage(8.0 * a, 0.02)),
        P("viscous_friction", "second", lambda a, *_: friction.EyringDrag(1.5 * a, 0.3)),
        P("linear_spring", "third", lambda a, *_: loads.RubberSpring(60.0 * a, 0.0, 0.03)),
        P("nonlinear_spring", "second", lambda a, *_: loads.PlaySpring(200.0 * a, 4e5 * a, 0.0, 0.006)),
        P("end_stop", "third", lambda a, *_: loads.Bumper(8e3 * a, 0.5, -0.012, 0.01)),
        P("constant_load", "second", lambda a, *_: loads.ConstantLoad(1.2 * a)),
        P("inertia_error", "third", lambda a, *_: loads.WrongInertia("m3", 0.12 * a)),
        P("flexible_transmission", "third",
          lambda a, *_: loads.Resonator("m3", min(0.15 * a, 0.5), 9.0, 0.03)),
        P("actuator_gain", "actuator:F", lambda a, *_: actuators.Gain(0.1 * a)),
        P("actuator_dead_zone", "actuator:F", lambda a, *_: actuators.RoundedDeadZone(1.0 * a)),
        P("input_delay", "actuator:F", lambda a, *_: actuators.Transport(0.008 * a)),
        P("sensor_gain", "sensor:x2", lambda a, *_: sensors.ScaleError(0.04 * a)),
        P("sensor_lag", "sensor:v3", lambda a, *_: sensors.LowPass(0.015 * a)),
        P("scatter", "first", changing.scattered_damping(1.5, -2.2)),
        P("floor_vibration", "second", foreign.floor_vibration(1.0, 6.0)),
    )  # fmt: skip


@dataclass(frozen=True)
class HydraulicCylinder(Mechanism):
    """Hydraulic cylinder that a servo valve moves; the pressure of its oil is a state.

    The pressure is the difference between the chambers, the load m (kg) the operating point.
    """

    m_p: float = 40.0  # mass of the piston, kg
    b: float = 500.0  # damping of the seals, N s/m
    A: float = 6e-4  # area of the piston, m^2
    C: float = 3.5e-13  # volume that the oil gives way per pressure, m^3/Pa
    k_q: float = 5e-5  # flow of the valve per voltage, m^3/(s V)
    k_l: float = 6e-12  # leakage of the piston per pressure, m^3/(s Pa)
    stiffness: float = 70.0  # proportional gain of the controller, V/m
    damping: float = 0.0  # derivative gain of the controller, V s/m

    limits = -10.0, 10.0
    levels = 1
    ports = {"rod": (1.0, 0.0), "oil": (0.0, 1.0)}  # noqa: RUF012
    name = "hydraulic_cylinder"
    input = "u"
    duration = 3.0
    runs = (9, 12)
    range = Range(0.06, 1.2)
    rest = -0.002, 0.002
    sensors = (
        Sensor("x", 0, False, 1e-5, 2e-5),
        Sensor("v", 0, True, 0.0, 0.004),
        Sensor("p", 1, False, 1e3, 4e3),
    )
    optional = ("v",)
    factors = {"m": (20.0, 60.0, 110.0)}  # noqa: RUF012
    friction = {"b": "rod", "k_l": "oil"}  # noqa: RUF012
    doubtful = {"m_p": ("inertia_error",)}  # noqa: RUF012

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
        P("linear_spring", "rod", lambda a, *_: loads.RubberSpring(3e3 * a, 0.0, 0.08)),
        P("end_stop", "rod", lambda a, *_: loads.Bumper(1e6 * a, 0.4, -0.03, 0.025)),
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
        P("scatter", "rod", changing.scattered_damping(250.0, -450.0)),
        P("sticky_valve", "actuator:u", lambda a, *_: foreign.StickyValve(0.4 * a)),
    )  # fmt: skip
