"""A step-down converter, averaged over its switching: a coil and a capacitor feed a resistive load."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.arrays import Array
from pipeline.rigs.withheld.balance import Balance
from pipeline.rigs.withheld.effects import actuators, flows, foreign, sensors
from pipeline.rigs.withheld.effects.effect import Plantable as P
from pipeline.rigs.withheld.machine import Range, Sensor


@dataclass(frozen=True)
class BuckConverter(Balance):
    """Constants of the converter; its input is the duty cycle.

    Attributes:
        V: supply, V.
        L: inductance of the coil, H.
        R: resistance of coil and switches, ohm.
        C: capacitance, F.
        R_o: resistance of the load, ohm.
        lost: inductance that is lost at high currents, H.
        knee: current at which much of it is lost, A.
        stiffness: gain of the controller of the voltage, 1/V.
    """

    V: float = 24.0
    L: float = 0.02
    R: float = 0.5
    C: float = 2e-3
    R_o: float = 5.0
    lost: float = 0.0
    knee: float = 1.0
    stiffness: float = 0.02

    limits = 0.0, 1.0
    ports = "capacitor", "coil"
    name = "buck_converter"
    input = "duty"
    periods = (0.001,)
    duration = 2.0
    runs = (9, 12)
    range = Range(0.35, 8.0, 0.5)
    sensors = (Sensor("v", 0, False, 5e-3, 0.01), Sensor("i", 1, False, 2e-3, 5e-3))
    friction = {"R": "coil"}  # noqa: RUF012
    doubtful = {"C": ("storage",)}  # noqa: RUF012

    def start(self, runs: int, rng: np.random.Generator) -> Array:
        voltage = rng.uniform(8.0, 13.0, runs)
        return np.stack([voltage, voltage / self.R_o])

    def flow(self, level: Array, u: Array) -> Array:
        v, i = level
        return np.stack([i - v / self.R_o, self.V * u - self.R * i - v])

    def capacity(self, level: Array) -> Array:
        coil = self.L - self.lost * np.tanh(level[1] / self.knee) ** 2
        return np.stack([np.full_like(coil, self.C), coil])

    def at_rest(self, u: Array) -> Array:
        return self.V * u * self.R_o / (self.R_o + self.R)

    plantable = (
        P("linear_loss", "capacitor", lambda a, *_: flows.Gap(0.02 * a, 0.02)),
        P("overflow", "capacitor", lambda a, *_: flows.ReliefValve(0.12 * a, 13.0, 0.2)),
        P("storage", "capacitor", lambda a, *_: flows.SecondStore(0.1 * a, 1e-3 * a)),
        P("inductance_saturation", "coil", lambda a, *_: flows.IronCore(min(4e-3 * a, 0.014), 2.5)),
        P("self_heating", "coil", lambda a, *_: flows.HotCopper(0.5, 0.3 * a, 0.4, 4.0)),
        P("actuator_gain", "actuator:duty", lambda a, *_: actuators.Gain(-min(0.06 * a, 0.5))),
        P("actuator_offset", "actuator:duty", lambda a, *_: actuators.Offset(-0.02 * a),
          (("constant_load", "coil"),)),
        P("input_delay", "actuator:duty", lambda a, *_: actuators.Transport(0.003 * a)),
        P("sensor_offset", "sensor:i", lambda a, *_: sensors.Bias(0.06 * a)),
        P("sensor_lag", "sensor:v", lambda a, *_: sensors.LowPass(4e-3 * a)),
        P("sticky_valve", "actuator:duty", lambda a, *_: foreign.StickyValve(0.05 * a)),
    )  # fmt: skip
