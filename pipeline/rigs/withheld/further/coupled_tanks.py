"""Two tanks with a pipe between them: a pump fills the first one, the second one empties."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.arrays import Array
from pipeline.rigs.withheld.balance import Balance
from pipeline.rigs.withheld.effects import actuators, flows, foreign, sensors
from pipeline.rigs.withheld.effects.effect import Plantable as P
from pipeline.rigs.withheld.machine import Range, Sensor


@dataclass(frozen=True)
class CoupledTanks(Balance):
    """Constants of the tanks.

    Attributes:
        A: cross-section of each tank, m^2.
        k_p: flow of the pump per voltage, m^3/(s V).
        k_c: flow through the pipe per difference of the levels, m^2/s.
        k_s: flow through the outlet at a level of 1 m, m^2.5/s.
        stiffness: gain of the controller of the first level, V/m.
    """

    A: float = 2e-4
    k_p: float = 3e-5
    k_c: float = 1e-3
    k_s: float = 2.74e-4
    stiffness: float = 20.0

    limits = 0.0, 10.0
    ports = "first", "second"
    name = "coupled_tanks"
    input = "u"
    periods = (0.002, 0.004)
    duration = 6.0
    runs = (9, 12)
    range = Range(3.2, 1.0, 5.0)
    sensors = (Sensor("h1", 0, False, 1e-4, 3e-4), Sensor("h2", 1, False, 1e-4, 3e-4))
    friction = {"k_s": "second"}  # noqa: RUF012
    doubtful = {"A": ("storage",)}  # noqa: RUF012

    def start(self, runs: int, rng: np.random.Generator) -> Array:
        low = rng.uniform(0.2, 0.3, runs)
        return np.stack([low + rng.uniform(0.1, 0.2, runs), low])

    def flow(self, level: Array, u: Array) -> Array:
        passed = self.k_c * (level[0] - level[1])
        return np.stack([self.k_p * u - passed, passed - self.k_s * np.sqrt(np.maximum(level[1], 0.0))])

    def capacity(self, level: Array) -> float:
        return self.A

    def at_rest(self, u: Array) -> Array:
        return (self.k_p * u / self.k_s) ** 2 + self.k_p * u / self.k_c

    plantable = (
        P("linear_loss", "first", lambda a, *_: flows.Gap(8e-5 * a, 0.3)),
        P("root_outflow", "first", lambda a, *_: flows.Orifice(5e-5 * a, 0.5, 0.02)),
        P("overflow", "first", lambda a, *_: flows.ReliefValve(6e-4 * a, 0.42, 0.008)),
        P("overflow", "second", lambda a, *_: flows.ReliefValve(4e-4 * a, 0.27, 0.005, 1.5, 0.1)),
        P("storage", "second", lambda a, *_: flows.SecondStore(1.5e-4 * a, 1.5e-4 * a, 0.1)),
        P("actuator_offset", "actuator:u", lambda a, *_: actuators.Offset(0.4 * a)),
        P("actuator_dead_zone", "actuator:u", lambda a, *_: actuators.RoundedDeadZone(0.8 * a)),
        P("input_delay", "actuator:u", lambda a, *_: actuators.Transport(0.03 * a)),
        P("actuator_saturation", "actuator:u", lambda a, *_: actuators.SoftSaturation(14.0 / a)),
        P("sensor_offset", "sensor:h2", lambda a, *_: sensors.Bias(0.02 * a)),
        P("sensor_gain", "sensor:h1", lambda a, *_: sensors.ScaleError(0.05 * a)),
        P("sticky_valve", "actuator:u", lambda a, *_: foreign.StickyValve(0.5 * a)),
    )  # fmt: skip
