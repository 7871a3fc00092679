"""A column of water that a pump fills and that empties through an opening."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.arrays import Array
from pipeline.rigs.withheld.balance import Balance
from pipeline.rigs.withheld.effects import actuators, flows, sensors
from pipeline.rigs.withheld.effects.effect import Plantable as P
from pipeline.rigs.withheld.machine import Range, Sensor


@dataclass(frozen=True)
class Column(Balance):
    """Constants of the column.

    Attributes:
        A: cross-section, m^2.
        k_p: flow of the pump per voltage, m^3/(s V).
        k_s: flow through the opening at a level of 1 m, m^2.5/s.
        stiffness: gain of the controller of the level, V/m.
    """

    A: float = 2e-4
    k_p: float = 3e-5
    k_s: float = 2.74e-4
    stiffness: float = 30.0

    limits = 0.0, 10.0
    name = "column"
    input = "u"
    periods = (0.002, 0.005)
    duration = 6.0
    runs = (9, 12)
    range = Range(3.2, 1.2, 5.0)
    sensors = (Sensor("h", 0, False, 1e-4, 3e-4),)
    friction = {"k_s": "water"}  # noqa: RUF012
    doubtful = {"A": ("storage",)}  # noqa: RUF012

    def start(self, runs: int, rng: np.random.Generator) -> Array:
        return rng.uniform(0.2, 0.4, (1, runs))

    def flow(self, level: Array, u: Array) -> Array:
        return self.k_p * u - self.k_s * np.sqrt(np.maximum(level, 0.0))

    def capacity(self, level: Array) -> float:
        return self.A

    def at_rest(self, u: Array) -> Array:
        return (self.k_p * u / self.k_s) ** 2

    plantable = (
        P("linear_loss", "water", lambda a, *_: flows.Gap(8e-5 * a, 0.3)),
        P("overflow", "water", lambda a, *_: flows.ReliefValve(4e-4 * a, 0.35, 0.005, 1.5, 0.1)),
        P("storage", "water", lambda a, *_: flows.SecondStore(1.5e-4 * a, 1.5e-4 * a, 0.1)),
        P("input_delay", "actuator:u", lambda a, *_: actuators.Transport(0.03 * a),
          (("sensor_delay", "sensor:h"),)),
        P("sensor_offset", "sensor:h", lambda a, *_: sensors.Bias(0.03 * a)),
    )  # fmt: skip
