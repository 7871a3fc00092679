"""A pendulum that a motor drives at its joint."""

from dataclasses import dataclass

import numpy as np

from pipeline.rigs.withheld.effects import actuators, changing, foreign, friction, loads, sensors
from pipeline.rigs.withheld.effects.effect import Plantable as P
from pipeline.rigs.withheld.effects.effect import Port
from pipeline.rigs.withheld.machine import Conditions, Machine, Range, Sensor
from unmodelled.base.arrays import Array


@dataclass(frozen=True)
class Pendulum(Machine):
    """Pendulum that is driven at its joint."""

    J: float = 0.02  # moment of inertia, kg m^2
    b: float = 0.03  # damping, N m s/rad
    mgl: float = 1.2  # weight times distance of the centre of mass from the joint, N m
    stiffness: float = 6.0  # stiffness of the controller of the angle, N m/rad
    damping: float = 0.4  # damping of this controller, N m s/rad
    supply: float = 3.0  # largest torque of this controller, N m

    name = "pendulum"
    input = "torque"
    periods = (0.001, 0.004)
    duration = 4.0
    range = Range(0.8, 2.5)
    rest = -0.8, 0.8
    sensors = (Sensor("theta", 0, False, 2.0 * np.pi / 8192, 6e-4), Sensor("omega", 0, True, 0.0, 0.02))
    optional = ("omega",)
    groups = ("left", "right")
    friction = {"b": "joint"}  # noqa: RUF012
    doubtful = {"mgl": ("gravity_load",)}  # noqa: RUF012

    def regulated(self, reference: Array, slope: Array, q: Array, v: Array, c: Conditions) -> Array:
        u = self.mgl * np.sin(reference) + self.stiffness * (reference - q[0]) + self.damping * (slope - v[0])
        return np.asarray(np.clip(u, -self.supply, self.supply))

    def rates(self, q: Array, v: Array, u: Array, c: Conditions) -> Array:
        return (u - self.b * v - self.mgl * np.sin(q)) / self.J

    def port(self, name: str, q: Array, v: Array, c: Conditions) -> Port:
        mobility = np.full_like(q, 1.0 / self.J)
        return Port(q[0], v[0], -mobility, mobility[0])

    def load(self, name: str, u: Array) -> Array:
        return np.asarray(u)

    plantable = (
        P("coulomb_friction", "joint", lambda a, *_: friction.Coulomb(0.03 * a), local=True),
        P("stribeck_friction", "joint", lambda a, *_: friction.TustinFriction(0.02 * a, 0.06 * a, 0.3)),
        P("load_friction", "joint", lambda a, *_: friction.GearFriction(min(0.15 * a, 0.5), 0.02)),
        P("quadratic_drag", "joint", lambda a, *_: friction.Windage(0.004 * a, 0.5), local=True),
        P("position_dependent_friction", "joint", lambda a, *_: friction.TightSpot(0.08 * a, 0.25, 0.2)),
        P("hysteresis", "joint", lambda a, *_: friction.MaxwellSlip(0.06 * a, 0.2)),
        P("linear_spring", "joint", lambda a, *_: loads.RubberSpring(0.12 * a, 0.0, 2.0)),
        P("nonlinear_spring", "joint", lambda a, *_: loads.OneSidedSpring(0.5 * a, 0.15, 1.0), local=True),
        P("end_stop", "joint", lambda a, *_: loads.Bumper(2.5 * a, 0.2, -0.6, 0.5)),
        P("constant_load", "joint", lambda a, *_: loads.ConstantLoad(0.05 * a),
          (("actuator_offset", "actuator:torque"),), local=True),
        P("gravity_load", "joint", lambda a, *_: loads.Unbalance(0.12 * a, 0.3)),
        P("torque_ripple", "joint",
          lambda a, *_: loads.Ripple([0.05 * a, 0.02 * a], [7.0, 14.0], [0.4, 1.9])),
        P("backlash", "joint", lambda a, *_: loads.LooseInertia("J", 0.006, 0.02 * a, 0.2, 0.1)),
        P("actuator_gain", "actuator:torque", lambda a, *_: actuators.Gain(0.1 * a)),
        P("actuator_offset", "actuator:torque", lambda a, *_: actuators.Offset(-0.05 * a),
          (("constant_load", "joint"),)),
        P("actuator_saturation", "actuator:torque", lambda a, *_: actuators.SoftSaturation(0.9 / a)),
        P("actuator_dead_zone", "actuator:torque", lambda a, *_: actuators.RoundedDeadZone(0.06 * a)),
        P("actuator_asymmetry", "actuator:torque",
          lambda a, *_: actuators.UnequalSides(min(0.12 * a, 0.5), 0.02)),
        P("actuator_lag", "actuator:torque", lambda a, *_: actuators.TwoPoleLag(0.02 * a)),
        P("actuator_rate_limit", "actuator:torque", lambda a, *_: actuators.SlowAmplifier(2.5 / a)),
        P("input_delay", "actuator:torque", lambda a, *_: actuators.Transport(0.013 * a),
          (("sensor_delay", "sensor:theta"),)),
        P("sensor_offset", "sensor:theta", lambda a, *_: sensors.Bias(0.04 * a)),
        P("sensor_gain", "sensor:omega", lambda a, *_: sensors.ScaleError(0.06 * a)),
        P("sensor_delay", "sensor:omega", lambda a, *_: sensors.Latency(0.009 * a)),
        P("sensor_lag", "sensor:omega", lambda a, *_: sensors.LowPass(0.03 * a)),
        P("drift", "joint", lambda a, plan, _: changing.WarmingBearing(0.03 * a, 15.0, plan.begin)),
        P("scatter", "joint", changing.scattered_damping(0.015, -0.025)),
        P("flexible_transmission", "joint",
          lambda a, *_: loads.Resonator("J", min(0.004 * a, 0.012), 6.0, 0.03)),
        P("floor_vibration", "joint", foreign.floor_vibration(0.06, 9.0)),
        P("missed_counts", "sensor:theta", lambda a, *_: foreign.MissedCounts(0.08 * a, 2.5)),
    )  # fmt: skip
