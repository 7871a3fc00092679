"""A heating wire in a block: two thermal masses, of which the block loses heat."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.arrays import Array
from pipeline.rigs.withheld.balance import Balance
from pipeline.rigs.withheld.effects import actuators, flows, foreign, sensors
from pipeline.rigs.withheld.effects.effect import Plantable as P
from pipeline.rigs.withheld.machine import Range, Sensor

_AROUND = 293.0  # K


@dataclass(frozen=True)
class HeatedBlock(Balance):
    """Constants of wire and block.

    Attributes:
        C1: heat capacity of the wire, J/K.
        C2: heat capacity of the block, J/K.
        k_c: conductance between wire and block, W/K.
        k: conductance between block and surroundings, W/K.
        stiffness: gain of the controller of the wire's temperature, W/K.
    """

    C1: float = 1.5e-3
    C2: float = 4e-3
    k_c: float = 0.012
    k: float = 8e-3
    stiffness: float = 8e-3

    limits = 0.0, 5.0
    ports = "wire", "block"
    name = "heated_block"
    input = "P"
    periods = (0.001, 0.002, 0.004)
    duration = 5.0
    runs = (9, 12)
    range = Range(1.7, 1.2, 1.9)
    sensors = (Sensor("T1", 0, False, 0.1, 0.3), Sensor("T2", 1, False, 0.05, 0.1))
    friction = {"k": "block"}  # noqa: RUF012
    doubtful = {"C1": ("storage",)}  # noqa: RUF012

    def start(self, runs: int, rng: np.random.Generator) -> Array:
        block = rng.uniform(400.0, 560.0, runs)
        return np.stack([block + rng.uniform(60.0, 180.0, runs), block])

    def flow(self, level: Array, u: Array) -> Array:
        passed = self.k_c * (level[0] - level[1])
        return np.stack([u - passed, passed - self.k * (level[1] - _AROUND)])

    def capacity(self, level: Array) -> Array:
        return np.array([[self.C1], [self.C2]])

    def at_rest(self, u: Array) -> Array:
        return _AROUND + u / self.k + u / self.k_c

    plantable = (
        P("radiation", "wire", lambda a, *_: flows.Radiator(0.3 * a, 700.0, _AROUND)),
        P("radiation", "block", lambda a, *_: flows.Radiator(0.2 * a, 550.0, _AROUND)),
        P("storage", "block", lambda a, *_: flows.SecondStore(4e-3 * a, 3e-3 * a)),
        P("storage", "wire", lambda a, *_: flows.SecondStore(3e-3 * a, 8e-4 * a)),
        P("actuator_gain", "actuator:P", lambda a, *_: actuators.Gain(-min(0.06 * a, 0.5))),
        P("actuator_offset", "actuator:P", lambda a, *_: actuators.Offset(0.1 * a)),
        P("actuator_lag", "actuator:P", lambda a, *_: actuators.TwoPoleLag(0.02 * a)),
        P("actuator_saturation", "actuator:P", lambda a, *_: actuators.SoftSaturation(5.0 / a)),
        P("sensor_lag", "sensor:T2", lambda a, *_: sensors.LowPass(0.05 * a)),
        P("sensor_gain", "sensor:T1", lambda a, *_: sensors.ScaleError(0.02 * a)),
        P("heated_motor", "actuator:P", lambda a, *_: foreign.HeatedMotor(0.02 * a, 1.0),
          (("drift", "actuator:P"), ("actuator_gain", "actuator:P"))),
    )  # fmt: skip
