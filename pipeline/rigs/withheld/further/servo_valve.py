"""A pneumatic valve whose spool follows its command with a lag, and the chamber that it fills."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.arrays import Array
from pipeline.rigs.withheld.balance import Balance
from pipeline.rigs.withheld.effects import actuators, flows, foreign, sensors
from pipeline.rigs.withheld.effects.effect import Plantable as P
from pipeline.rigs.withheld.machine import Range, Sensor


@dataclass(frozen=True)
class ServoValve(Balance):
    """Constants of valve and chamber; pressures are relative to that of the surroundings.

    Attributes:
        C: stored volume per pressure, m^3/Pa.
        k_v: flow of the open valve at the pressure of the supply, m^3/s.
        p_s: pressure of the supply, Pa.
        k_o: flow of the throttle at the outlet per pressure, m^3/(s Pa).
        tau: time constant of the spool, s.
        k_u: opening per voltage, 1/V.
        stiffness: gain of the controller of the pressure, V/Pa.
    """

    C: float = 1.5e-8
    k_v: float = 0.04
    p_s: float = 6e5
    k_o: float = 6e-8
    tau: float = 0.03
    k_u: float = 0.1
    stiffness: float = 1e-5

    limits = 0.0, 10.0
    ports = "gas", "spool"
    name = "servo_valve"
    input = "u"
    periods = (0.001, 0.002)
    duration = 4.0
    runs = (9, 12)
    range = Range(3.5, 2.5, 5.0)
    sensors = (Sensor("p", 0, False, 60.0, 200.0), Sensor("s", 1, False, 5e-4, 1e-3))
    friction = {"k_o": "gas"}  # noqa: RUF012
    doubtful = {"C": ("storage",)}  # noqa: RUF012

    def start(self, runs: int, rng: np.random.Generator) -> Array:
        return np.stack([rng.uniform(1.5e5, 3.5e5, runs), rng.uniform(0.3, 0.6, runs)])

    def flow(self, level: Array, u: Array) -> Array:
        p, s = level
        filled = self.k_v * s * np.sqrt(np.maximum(1.0 - p / self.p_s, 0.0))
        return np.stack([filled - self.k_o * p, self.k_u * u - s])

    def capacity(self, level: Array) -> Array:
        return np.array([[self.C], [self.tau]])

    def at_rest(self, u: Array) -> Array:
        most = (self.k_v * self.k_u * u / self.k_o) ** 2 / self.p_s
        return 0.5 * (np.sqrt(most**2 + 4.0 * most * self.p_s) - most)

    plantable = (
        P("root_outflow", "gas", lambda a, *_: flows.Orifice(3e-3 * a, 2.5e5, 3e3)),
        P("linear_loss", "gas", lambda a, *_: flows.Gap(1.2e-8 * a, 3e-7)),
        P("overflow", "gas", lambda a, *_: flows.ReliefValve(4e-8 * a, 2.6e5, 4e3)),
        P("storage", "gas", lambda a, *_: flows.SecondStore(3e-8 * a, 1.5e-8 * a, 5e4)),
        P("actuator_offset", "actuator:u", lambda a, *_: actuators.Offset(0.2 * a)),
        P("actuator_dead_zone", "actuator:u", lambda a, *_: actuators.RoundedDeadZone(0.5 * a)),
        P("actuator_asymmetry", "actuator:u", lambda a, *_: actuators.UnequalSides(min(0.05 * a, 0.3), 2.0),
          (("actuator_gain", "actuator:u"),)),
        P("input_delay", "actuator:u", lambda a, *_: actuators.Transport(0.012 * a)),
        P("actuator_rate_limit", "actuator:u", lambda a, *_: actuators.SlowAmplifier(25.0 / a)),
        P("sensor_gain", "sensor:s", lambda a, *_: sensors.ScaleError(0.05 * a)),
        P("sensor_lag", "sensor:p", lambda a, *_: sensors.LowPass(0.03 * a), (("sensor_delay", "sensor:p"),)),
        P("sticky_valve", "actuator:u", lambda a, *_: foreign.StickyValve(0.4 * a)),
    )  # fmt: skip
