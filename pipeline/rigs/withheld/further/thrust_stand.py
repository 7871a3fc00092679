"""A thrust stand: a motor turns a propeller, whose thrust lifts an arm."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.arrays import Array
from pipeline.rigs.withheld.effects import actuators, changing, elastic, foreign, friction, loads, sensors
from pipeline.rigs.withheld.effects.effect import Plantable as P
from pipeline.rigs.withheld.machine import Conditions, Range, Sensor
from pipeline.rigs.withheld.mechanism import Mechanism


@dataclass(frozen=True)
class ThrustStand(Mechanism):
    """Constants of the stand; the arm hangs down at the angle 0, and the speed of the rotor is controlled.

    Attributes:
        J: moment of inertia of the arm, kg m^2.
        b: damping of the arm, N m s/rad.
        mgl: weight times distance of the arm's centre of mass, N m.
        l: distance of the propeller from the pivot, m.
        k_T: thrust per squared speed, N s^2/rad^2.
        J_r: moment of inertia of rotor and propeller, kg m^2.
        k_Q: torque of the air per squared speed, N m s^2/rad^2.
        kt: torque constant and back-EMF constant of the motor, N m/A.
        R: resistance of the motor, ohm.
        stiffness: proportional gain of the controller of the speed, V s/rad.
        damping: not used.
    """

    J: float = 0.06
    b: float = 0.06
    mgl: float = 2.4
    l: float = 0.4
    k_T: float = 2.5e-5
    J_r: float = 1.2e-4
    k_Q: float = 4e-7
    kt: float = 0.02
    R: float = 0.4
    stiffness: float = 0.02
    damping: float = 0.0

    limits = 0.0, 16.0
    levels = 1
    led = 1
    ports = {"arm": (1.0, 0.0), "rotor": (0.0, 1.0)}  # noqa: RUF012
    name = "thrust_stand"
    input = "u"
    periods = (0.001, 0.002, 0.004)
    duration = 5.0
    runs = (8, 10)
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
        P("linear_spring", "arm", lambda a, *_: elastic.RubberSpring(0.3 * a, 0.0, 0.5)),
        P("end_stop", "arm", lambda a, *_: elastic.Bumper(20.0 * a, 0.2, 0.12, 0.36)),
        P("constant_load", "arm", lambda a, *_: loads.ConstantLoad(0.1 * a)),
        P("inertia_error", "rotor", lambda a, *_: loads.WrongInertia("J_r", 3e-5 * a)),
        P("actuator_gain", "actuator:u", lambda a, *_: actuators.Gain(-min(0.08 * a, 0.5))),
        P("actuator_saturation", "actuator:u", lambda a, *_: actuators.SoftSaturation(12.0 / a)),
        P("input_delay", "actuator:u", lambda a, *_: actuators.Transport(0.02 * a)),
        P("sensor_lag", "sensor:omega", lambda a, *_: sensors.LowPass(0.03 * a)),
        P("sensor_gain", "sensor:omega", lambda a, *_: sensors.ScaleError(0.05 * a)),
        P("scatter", "arm", lambda a, plan, rng: changing.scattered_damping(0.04 * a, -0.05, plan.runs, rng)),
        P("heated_motor", "actuator:u", lambda a, *_: foreign.HeatedMotor(2e-3 * a, 1.0),
          (("drift", "actuator:u"), ("actuator_gain", "actuator:u"))),
    )  # fmt: skip
