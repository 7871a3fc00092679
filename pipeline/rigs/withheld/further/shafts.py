"""Machines that a motor turns: a servo, a drive with two inertias, a thrust stand."""

from dataclasses import dataclass

import numpy as np

from pipeline.rigs.withheld.effects import actuators, changing, flows, foreign, friction, loads, sensors
from pipeline.rigs.withheld.effects.effect import Plantable as P
from pipeline.rigs.withheld.machine import Conditions, Range, Sensor
from pipeline.rigs.withheld.mechanism import Mechanism
from unmodelled.base.arrays import Array


@dataclass(frozen=True)
class RotaryServo(Mechanism):
    """Servo: a direct-current motor with inductance turns a disc, with position control."""

    J: float = 4e-4  # moment of inertia of rotor and disc, kg m^2
    b: float = 4e-4  # damping of the bearings, N m s/rad
    kt: float = 0.08  # torque constant and back-EMF constant, N m/A
    R: float = 2.0  # resistance of the winding, ohm
    L: float = 8e-3  # inductance of the winding, H
    stiffness: float = 9.0  # proportional gain of the controller, V/rad
    damping: float = 0.3  # derivative gain of the controller, V s/rad

    limits = -24.0, 24.0
    levels = 1
    ports = {"shaft": (1.0, 0.0), "coil": (0.0, 1.0)}  # noqa: RUF012
    name = "rotary_servo"
    input = "u"
    duration = 3.0
    range = Range(2.0, 1.8)
    rest = -0.05, 0.05
    sensors = (
        Sensor("theta", 0, False, 2.0 * np.pi / 8192, 4e-4),
        Sensor("omega", 0, True, 0.0, 0.12),
        Sensor("i", 1, False, 2e-3, 5e-3),
    )
    optional = ("omega",)
    friction = {"b": "shaft"}  # noqa: RUF012
    doubtful = {"J": ("inertia_error",), "R": ("self_heating",)}  # noqa: RUF012

    def held(self, reference: Array, slope: Array, c: Conditions) -> Array:
        return (self.kt + self.R * self.b / self.kt) * slope

    def inertia(self, q: Array, c: Conditions) -> tuple[tuple[float, ...], ...]:
        return (self.J, 0.0), (0.0, self.L)

    def efforts(self, q: Array, v: Array, u: Array, c: Conditions) -> tuple[Array, ...]:
        return self.kt * q[1] - self.b * v[0], u - self.R * q[1] - self.kt * v[0]

    plantable = (
        P("coulomb_friction", "shaft", lambda a, *_: friction.Coulomb(0.01 * a)),
        P("stribeck_friction", "shaft", lambda a, *_: friction.LorentzFriction(0.006 * a, 0.018 * a, 1.5)),
        P("quadratic_drag", "shaft", lambda a, *_: friction.Windage(1e-4 * a, 2.0)),
        P("torque_ripple", "shaft",
          lambda a, *_: loads.Ripple([0.012 * a, 0.005 * a], [7.0, 14.0], [0.3, 1.7])),
        P("inertia_error", "shaft", lambda a, *_: loads.WrongInertia("J", 1e-4 * a)),
        P("backlash", "shaft", lambda a, *_: loads.LooseInertia("J", 8e-5, 0.05 * a, 0.2, 0.2)),
        P("self_heating", "coil", lambda a, *_: flows.HotCopper(2.0, 0.15 * a, 0.6, 6.0)),
        P("actuator_saturation", "actuator:u", lambda a, *_: actuators.SoftSaturation(8.0 / a)),
        P("actuator_dead_zone", "actuator:u", lambda a, *_: actuators.RoundedDeadZone(0.5 * a)),
        P("input_delay", "actuator:u", lambda a, *_: actuators.Transport(0.005 * a)),
        P("sensor_gain", "sensor:i", lambda a, *_: sensors.ScaleError(0.06 * a)),
        P("sensor_delay", "sensor:omega", lambda a, *_: sensors.Latency(0.006 * a)),
        P("drift", "shaft", lambda a, plan, _: changing.WarmingBearing(1.2e-3 * a, 12.0, plan.begin)),
        P("missed_counts", "sensor:theta", lambda a, *_: foreign.MissedCounts(0.06 * a, 12.0)),
        P("heated_motor", "actuator:u", lambda a, *_: foreign.HeatedMotor(0.02 * a, 0.6),
          (("drift", "actuator:u"), ("actuator_gain", "actuator:u"))),
    )  # fmt: skip


@dataclass(frozen=True)
class CoupledDrive(Mechanism):
    """Drive with two inertias: a motor turns a load through a flexible coupling."""

    J1: float = 0.002  # moment of inertia of the motor, kg m^2
    J2: float = 0.006  # moment of inertia of the load, kg m^2
    k: float = 30.0  # stiffness of the coupling, N m/rad
    d: float = 0.03  # damping of the coupling, N m s/rad
    b1: float = 0.01  # damping of the motor, N m s/rad
    b2: float = 0.02  # damping of the load, N m s/rad
    stiffness: float = 2.0  # proportional gain of the controller, N m/rad
    damping: float = 0.12  # derivative gain of the controller, N m s/rad

    limits = -4.0, 4.0
    ports = {"motor": (1.0, 0.0), "load": (0.0, 1.0), "coupling": (1.0, -1.0)}  # noqa: RUF012
    name = "coupled_drive"
    input = "T"
    duration = 3.0
    range = Range(1.2, 2.0)
    sensors = (
        Sensor("q1", 0, False, 2.0 * np.pi / 16384, 2e-4),
        Sensor("q2", 1, False, 2.0 * np.pi / 16384, 2e-4),
        Sensor("w1", 0, True, 0.0, 0.05),
        Sensor("w2", 1, True, 0.0, 0.05),
    )
    optional = ("w2",)
    friction = {"b1": "motor", "b2": "load"}  # noqa: RUF012
    doubtful = {"J2": ("inertia_error",)}  # noqa: RUF012

    def start(self, runs: int, rng: np.random.Generator) -> Array:
        return np.tile(rng.uniform(-0.05, 0.05, runs), (2, 1))

    def held(self, reference: Array, slope: Array, c: Conditions) -> Array:
        return (self.b1 + self.b2) * slope

    def inertia(self, q: Array, c: Conditions) -> tuple[tuple[float, ...], ...]:
        return (self.J1, 0.0), (0.0, self.J2)

    def efforts(self, q: Array, v: Array, u: Array, c: Conditions) -> tuple[Array, ...]:
        passed = self.k * (q[0] - q[1]) + self.d * (v[0] - v[1])
        return u - self.b1 * v[0] - passed, passed - self.b2 * v[1]

    def load(self, name: str, u: Array) -> Array:
        return np.asarray(u if name == "motor" else 0.0 * u)

    plantable = (
        P("coulomb_friction", "load", lambda a, *_: friction.Coulomb(0.1 * a)),
        P("stribeck_friction", "motor", lambda a, *_: friction.TustinFriction(0.06 * a, 0.15 * a, 0.6)),
        P("load_friction", "motor", lambda a, *_: friction.GearFriction(min(0.15 * a, 0.5), 0.02)),
        P("hysteresis", "coupling", lambda a, *_: friction.MaxwellSlip(0.15 * a, 0.01)),
        P("viscous_friction", "load", lambda a, *_: friction.EyringDrag(0.03 * a, 4.0)),
        P("nonlinear_spring", "coupling", lambda a, *_: loads.PlaySpring(30.0 * a, 1e5 * a, 0.0, 0.008)),
        P("gravity_load", "load", lambda a, *_: loads.Unbalance(0.15 * a, 0.4)),
        P("constant_load", "load", lambda a, *_: loads.ConstantLoad(0.12 * a)),
        P("backlash", "load", lambda a, *_: loads.LooseInertia("J2", 0.0015, 0.03 * a, 0.2, 0.1)),
        P("inertia_error", "load", lambda a, *_: loads.WrongInertia("J2", 1e-3 * a)),
        P("actuator_gain", "actuator:T", lambda a, *_: actuators.Gain(-min(0.1 * a, 0.5))),
        P("actuator_lag", "actuator:T", lambda a, *_: actuators.TwoPoleLag(0.005 * a)),
        P("sensor_lag", "sensor:w2", lambda a, *_: sensors.LowPass(0.012 * a)),
        P("sensor_offset", "sensor:q2", lambda a, *_: sensors.Bias(8e-3 * a)),
        P("scatter", "load", changing.scattered_damping(0.015, -0.018)),
        P("floor_vibration", "load", foreign.floor_vibration(0.15, 7.0)),
    )  # fmt: skip


@dataclass(frozen=True)
class ThrustStand(Mechanism):
    """Thrust stand: a motor turns a propeller, whose thrust lifts an arm.

    The arm hangs down at the angle 0, and the speed of the rotor is controlled.
    """

    J: float = 0.06  # moment of inertia of the arm, kg m^2
    b: float = 0.06  # damping of the arm, N m s/rad
    mgl: float = 2.4  # weight times distance of the arm's centre of mass, N m
    l: float = 0.4  # distance of the propeller from the pivot, m
    k_T: float = 2.5e-5  # thrust per squared speed, N s^2/rad^2
    J_r: float = 1.2e-4  # moment of inertia of rotor and propeller, kg m^2
    k_Q: float = 4e-7  # torque of the air per squared speed, N m s^2/rad^2
    kt: float = 0.02  # torque constant and back-EMF constant of the motor, N m/A
    R: float = 0.4  # resistance of the motor, ohm
    stiffness: float = 0.02  # proportional gain of the controller of the speed, V s/rad
    damping: float = 0.0  # not used

    limits = 0.0, 16.0
    levels = 1
    led = 1
    ports = {"arm": (1.0, 0.0), "rotor": (0.0, 1.0)}  # noqa: RUF012
    name = "thrust_stand"
    input = "u"
    periods = (0.001, 0.002, 0.004)
    duration = 5.0
    range = Range(130.0, 1.2, 240.0)
    sensors = (
        Sensor("phi", 0, False, 2.0 * np.pi / 16384, 2e-4),
        Sensor("w", 0, True, 0.0, 0.01),
        Sensor("omega", 1, False, 0.2, 0.4),
    )
    optional = ("w",)
    friction = {"b": "arm"}  # noqa: RUF012
    doubtful = {"J": ("inertia_error",), "k_Q": ("quadratic_drag",)}  # noqa: RUF012

    def start(self, runs: int, rng: np.random.Generator) -> Array:
        omega = rng.uniform(200.0, 280.0, runs)
        return np.stack([np.arcsin(self.l * self.k_T * omega**2 / self.mgl), omega])

    def held(self, reference: Array, slope: Array, c: Conditions) -> Array:
        torque = self.k_Q * np.abs(reference) * reference + self.J_r * slope
        return self.kt * reference + self.R / self.kt * torque

    def inertia(self, q: Array, c: Conditions) -> tuple[tuple[float, ...], ...]:
        return (self.J, 0.0), (0.0, self.J_r)

    def efforts(self, q: Array, v: Array, u: Array, c: Conditions) -> tuple[Array, ...]:
        square = q[1] * np.abs(q[1])
        arm = self.l * self.k_T * square - self.b * v[0] - self.mgl * np.sin(q[0])
        return arm, self.kt * (u - self.kt * q[1]) / self.R - self.k_Q * square

    def load(self, name: str, u: Array) -> Array:
        return np.asarray(self.kt / self.R * u if name == "rotor" else 0.0 * u)

    plantable = (
        P("coulomb_friction", "arm", lambda a, *_: friction.Coulomb(0.03 * a)),
        P("coulomb_friction", "rotor", lambda a, *_: friction.ArctanFriction(0.012 * a, 15.0)),
        P("quadratic_drag", "arm", lambda a, *_: friction.Windage(0.12 * a, 0.1)),
        P("viscous_friction", "rotor", lambda a, *_: friction.EyringDrag(5e-5 * a, 200.0)),
        P("hysteresis", "arm", lambda a, *_: friction.MaxwellSlip(0.06 * a, 0.08)),
        P("linear_spring", "arm", lambda a, *_: loads.RubberSpring(0.3 * a, 0.0, 0.5)),
        P("end_stop", "arm", lambda a, *_: loads.Bumper(20.0 * a, 0.2, 0.12, 0.36)),
        P("constant_load", "arm", lambda a, *_: loads.ConstantLoad(0.1 * a)),
        P("inertia_error", "rotor", lambda a, *_: loads.WrongInertia("J_r", 3e-5 * a)),
        P("actuator_gain", "actuator:u", lambda a, *_: actuators.Gain(-min(0.08 * a, 0.5))),
        P("actuator_saturation", "actuator:u", lambda a, *_: actuators.SoftSaturation(12.0 / a)),
        P("input_delay", "actuator:u", lambda a, *_: actuators.Transport(0.02 * a)),
        P("sensor_lag", "sensor:omega", lambda a, *_: sensors.LowPass(0.03 * a)),
        P("sensor_gain", "sensor:omega", lambda a, *_: sensors.ScaleError(0.05 * a)),
        P("scatter", "arm", changing.scattered_damping(0.04, -0.05)),
        P("heated_motor", "actuator:u", lambda a, *_: foreign.HeatedMotor(2e-3 * a, 1.0),
          (("drift", "actuator:u"), ("actuator_gain", "actuator:u"))),
    )  # fmt: skip
