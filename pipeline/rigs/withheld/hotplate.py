"""A small plate that a current heats up to 900 K; it loses heat through its suspension."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.arrays import Array
from pipeline.rigs.withheld.balance import Balance
from pipeline.rigs.withheld.effects import actuators, flows
from pipeline.rigs.withheld.effects.effect import Plantable as P
from pipeline.rigs.withheld.machine import Range, Sensor

_AROUND = 293.0  # K


@dataclass(frozen=True)
class Hotplate(Balance):
    """Constants of the plate.

    Attributes:
        C: heat capacity, J/K.
        k: conductance of the suspension, W/K.
        stiffness: gain of the controller of the temperature, W/K.
    """

    C: float = 2e-3
    k: float = 5e-3
    stiffness: float = 1e-2

    limits = 0.0, 5.0
    name = "hotplate"
    input = "P"
    periods = (0.001, 0.002)
    duration = 4.0
    runs = (9, 12)
    range = Range(1.6, 1.2, 1.8)
    sensors = (Sensor("T", 0, False, 0.1, 0.4),)
    friction = {"k": "plate"}  # noqa: RUF012

    def start(self, runs: int, rng: np.random.Generator) -> Array:
        return rng.uniform(450.0, 750.0, (1, runs))

    def flow(self, level: Array, u: Array) -> Array:
        return u - self.k * (level - _AROUND)

    def capacity(self, level: Array) -> float:
        return self.C

    def at_rest(self, u: Array) -> Array:
        return _AROUND + u / self.k

    plantable = (
        P("radiation", "plate", lambda a, *_: flows.Radiator(0.35 * a, 700.0, _AROUND)),
        P("storage", "plate", lambda a, *_: flows.SecondStore(3e-3 * a, 2e-3 * a)),
        P("actuator_offset", "actuator:P", lambda a, *_: actuators.Offset(0.12 * a),
          (("constant_load", "plate"), ("sensor_offset", "sensor:T"))),
        P("actuator_lag", "actuator:P", lambda a, *_: actuators.TwoPoleLag(0.02 * a)),
    )  # fmt: skip
