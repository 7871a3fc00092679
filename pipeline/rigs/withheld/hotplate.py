"""A small plate that a current heats up to 900 K; it loses heat through its suspension."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.rigs.withheld.balance import Balance
from pipeline.rigs.withheld.effects import actuators, flows
from pipeline.rigs.withheld.effects.effect import Plantable as P
from pipeline.rigs.withheld.effects.effect import Port
from pipeline.rigs.withheld.machine import Array, Conditions, Range, Sensor

_AROUND = 293.0  # K


@dataclass(frozen=True)
class Hotplate(Balance):
    """Constants of the plate.

    Attributes:
        C: heat capacity, J/K.
        k: conductance of the suspension, W/K.
        stiffness: gain of the controller of the temperature, W/K.
        supply: largest power of the controller, W.
    """

    C: float = 2e-3
    k: float = 5e-3
    stiffness: float = 1e-2
    supply: float = 5.0

    name = "hotplate"
    input = "P"
    periods = (0.001, 0.002)
    duration = 4.0
    runs = (9, 12)
    range = Range(1.6, 1.2, 1.8)
    sensors = (Sensor("T", 0, False, 0.1, 0.4),)
    friction = {"k": "plate"}  # noqa: RUF012
    doubtful = {}  # noqa: RUF012

    def start(self, runs: int, rng: np.random.Generator) -> Array:
        return rng.uniform(450.0, 750.0, (1, runs))

    def regulated(self, reference: Array, slope: Array, q: Array, v: Array, c: Conditions) -> Array:
        u = reference + self.stiffness * (_AROUND + reference / self.k - q[0])
        return np.asarray(np.clip(u, 0.0, self.supply))

    def rates(self, q: Array, v: Array, u: Array, c: Conditions) -> Array:
        return (u - self.k * (q - _AROUND)) / self.C

    def port(self, name: str, q: Array, v: Array, c: Conditions) -> Port:
        mobility = np.full_like(q, 1.0 / self.C)
        return Port(q[0], v[0], -mobility, mobility[0])

    plantable = (
        P("radiation", "plate", lambda a, *_: flows.Radiator(0.35 * a, 700.0, _AROUND)),
        P("storage", "plate", lambda a, *_: flows.SecondStore(3e-3 * a, 2e-3 * a)),
        P("actuator_offset", "actuator:P", lambda a, *_: actuators.Offset(0.12 * a),
          (("constant_load", "plate"), ("sensor_offset", "sensor:T"))),
        P("actuator_lag", "actuator:P", lambda a, *_: actuators.TwoPoleLag(0.02 * a)),
    )  # fmt: skip
