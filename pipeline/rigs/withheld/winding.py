"""A winding at a voltage: the coil of a drive at standstill."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.arrays import Array
from pipeline.rigs.withheld.balance import Balance
from pipeline.rigs.withheld.effects import actuators, flows, sensors
from pipeline.rigs.withheld.effects.effect import Plantable as P
from pipeline.rigs.withheld.machine import Range, Sensor


@dataclass(frozen=True)
class Winding(Balance):
    """Constants of the winding.

    Attributes:
        L: inductance, H.
        R: resistance of the cold winding, ohm.
        lost: inductance that is lost at high currents, H.
        knee: current at which much of it is lost, A.
        stiffness: gain of the controller of the current, V/A.
    """

    L: float = 0.04
    R: float = 1.6
    lost: float = 0.0
    knee: float = 1.0
    stiffness: float = 4.0

    limits = -12.0, 12.0
    name = "winding"
    input = "u"
    periods = (0.001, 0.002)
    duration = 3.0
    runs = (9, 12)
    range = Range(7.0, 6.0)
    sensors = (Sensor("i", 0, False, 1e-3, 4e-3),)
    friction = {"R": "coil"}  # noqa: RUF012

    def start(self, runs: int, rng: np.random.Generator) -> Array:
        return np.zeros((1, runs))

    def flow(self, level: Array, u: Array) -> Array:
        return u - self.R * level

    def capacity(self, level: Array) -> Array:
        return self.L - self.lost * np.tanh(level / self.knee) ** 2

    def at_rest(self, u: Array) -> Array:
        return u / self.R

    plantable = (
        P("inductance_saturation", "coil", lambda a, *_: flows.IronCore(min(0.01 * a, 0.03), 2.5)),
        P("self_heating", "coil", lambda a, *_: flows.HotCopper(1.6, 0.01 * a, 0.8, 8.0)),
        P("actuator_dead_zone", "actuator:u", lambda a, *_: actuators.RoundedDeadZone(0.4 * a)),
        P("input_delay", "actuator:u", lambda a, *_: actuators.Transport(0.004 * a),
          (("sensor_delay", "sensor:i"),)),
        P("sensor_offset", "sensor:i", lambda a, *_: sensors.Bias(0.15 * a),
          (("actuator_offset", "actuator:u"), ("constant_load", "coil"))),
    )  # fmt: skip
