"""A capacitor cell, whose current is measured; the voltage shows its charge and its resistance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.arrays import Array
from pipeline.rigs.withheld.balance import Balance
from pipeline.rigs.withheld.effects import flows, sensors
from pipeline.rigs.withheld.effects.effect import Plantable as P
from pipeline.rigs.withheld.machine import Range, Sensor

_RESISTANCE = 0.02  # ohm
_CHARGED = 3.3  # V


@dataclass(frozen=True)
class Cell(Balance):
    """Constants of the cell; a positive current discharges it.

    Attributes:
        C: capacitance, F.
        R: resistance, ohm, which the sensor sees.
        stiffness: gain of the controller of the voltage, A/V.
    """

    C: float = 20.0
    R: float = _RESISTANCE
    stiffness: float = -20.0

    limits = -8.0, 8.0
    name = "cell"
    input = "i"
    measured = True
    periods = (0.001, 0.002)
    duration = 4.0
    runs = (9, 12)
    range = Range(5.0, 2.0)
    sensors = (Sensor("U", 0, False, 2e-4, 5e-4, through=-_RESISTANCE),)

    def start(self, runs: int, rng: np.random.Generator) -> Array:
        return rng.uniform(_CHARGED - 0.1, _CHARGED + 0.1, (1, runs))

    def flow(self, level: Array, u: Array) -> Array:
        return -u + np.zeros_like(level)

    def capacity(self, level: Array) -> float:
        return self.C

    def at_rest(self, u: Array) -> Array:
        return np.full_like(u, _CHARGED)

    def load(self, name: str, u: Array) -> Array:
        return u

    plantable = (
        P("rc_branch", "sensor:U", lambda a, *_: flows.Polarisation(0.02 * a, 0.3, 0.005 * a, 0.06)),
        P("linear_loss", "charge", lambda a, *_: flows.Gap(0.15 * a, 0.05),
          (("constant_load", "charge"), ("actuator_offset", "actuator:i"))),
        P("sensor_lag", "sensor:U", lambda a, *_: sensors.LowPass(0.03 * a),
          (("actuator_lag", "actuator:i"), ("input_delay", "actuator:i"), ("sensor_delay", "sensor:U"))),
    )  # fmt: skip
