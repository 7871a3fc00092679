"""A pressure vessel that a proportional valve fills and a laminar throttle empties."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.arrays import Array
from pipeline.rigs.withheld.balance import Balance
from pipeline.rigs.withheld.effects import actuators, flows, sensors
from pipeline.rigs.withheld.effects.effect import Plantable as P
from pipeline.rigs.withheld.machine import Range, Sensor


@dataclass(frozen=True)
class Vessel(Balance):
    """Constants of the vessel; pressures are relative to that of the surroundings.

    Attributes:
        C: stored volume per pressure, m^3/Pa.
        k_v: flow of the valve per voltage, m^3/(s V).
        k_o: flow of the throttle per pressure, m^3/(s Pa).
        stiffness: gain of the controller of the pressure, V/Pa.
    """

    C: float = 1.5e-8
    k_v: float = 3e-3
    k_o: float = 6e-8
    stiffness: float = 4e-5

    limits = 0.0, 10.0
    name = "vessel"
    input = "u"
    periods = (0.001, 0.002)
    duration = 4.0
    runs = (9, 12)
    range = Range(4.0, 1.6, 5.0)
    sensors = (Sensor("p", 0, False, 60.0, 200.0),)
    friction = {"k_o": "gas"}  # noqa: RUF012
    doubtful = {"C": ("storage",)}  # noqa: RUF012

    def start(self, runs: int, rng: np.random.Generator) -> Array:
        return rng.uniform(1.5e5, 3.5e5, (1, runs))

    def flow(self, level: Array, u: Array) -> Array:
        return self.k_v * u - self.k_o * level

    def capacity(self, level: Array) -> float:
        return self.C

    def at_rest(self, u: Array) -> Array:
        return self.k_v * u / self.k_o

    plantable = (
        P("root_outflow", "gas", lambda a, *_: flows.Orifice(3e-3 * a, 2.5e5, 3e3)),
        P("overflow", "gas", lambda a, *_: flows.ReliefValve(4e-8 * a, 2.6e5, 4e3)),
        P("storage", "gas", lambda a, *_: flows.SecondStore(3e-8 * a, 1.5e-8 * a, 5e4)),
        P("actuator_lag", "actuator:u", lambda a, *_: actuators.TwoPoleLag(0.02 * a)),
        P("sensor_lag", "sensor:p", lambda a, *_: sensors.LowPass(0.03 * a),
          (("actuator_lag", "actuator:u"), ("input_delay", "actuator:u"), ("sensor_delay", "sensor:p"))),
    )  # fmt: skip
