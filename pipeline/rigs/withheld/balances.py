"""Machines without inertia: a pressure vessel, a column of water, a hotplate, a winding, a cell."""

from dataclasses import dataclass

import numpy as np

from pipeline.rigs.withheld.balance import Balance
from pipeline.rigs.withheld.effects import actuators, flows, sensors
from pipeline.rigs.withheld.effects.effect import Plantable as P
from pipeline.rigs.withheld.machine import Range, Sensor
from unmodelled.base.arrays import Array


@dataclass(frozen=True)
class Vessel(Balance):
    """Pressure vessel, above ambient, that a proportional valve fills and a laminar throttle empties."""

    C: float = 1.5e-8  # stored volume per pressure, m^3/Pa
    k_v: float = 3e-3  # flow of the valve per voltage, m^3/(s V)
    k_o: float = 6e-8  # flow of the throttle per pressure, m^3/(s Pa)
    stiffness: float = 4e-5  # gain of the controller of the pressure, V/Pa

    limits = 0.0, 10.0
    name = "vessel"
    input = "u"
    duration = 4.0
    range = Range(4.0, 1.6, 5.0)
    rest = 1.5e5, 3.5e5
    sensors = (Sensor("p", 0, False, 60.0, 200.0),)
    friction = {"k_o": "gas"}  # noqa: RUF012
    doubtful = {"C": ("storage",)}  # noqa: RUF012

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


@dataclass(frozen=True)
class Column(Balance):
    """Column of water that a pump fills and that empties through an opening."""

    A: float = 2e-4  # cross-section, m^2
    k_p: float = 3e-5  # flow of the pump per voltage, m^3/(s V)
    k_s: float = 2.74e-4  # flow through the opening at a level of 1 m, m^2.5/s
    stiffness: float = 30.0  # gain of the controller of the level, V/m

    limits = 0.0, 10.0
    name = "column"
    input = "u"
    periods = (0.002, 0.005)
    duration = 6.0
    range = Range(3.2, 1.2, 5.0)
    rest = 0.2, 0.4
    sensors = (Sensor("h", 0, False, 1e-4, 3e-4),)
    friction = {"k_s": "water"}  # noqa: RUF012
    doubtful = {"A": ("storage",)}  # noqa: RUF012

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


_AROUND = 293.0  # K


@dataclass(frozen=True)
class Hotplate(Balance):
    """Small plate that a current heats up to 900 K; it loses heat through its suspension."""

    C: float = 2e-3  # heat capacity, J/K
    k: float = 5e-3  # conductance of the suspension, W/K
    stiffness: float = 1e-2  # gain of the controller of the temperature, W/K

    limits = 0.0, 5.0
    name = "hotplate"
    input = "P"
    duration = 4.0
    range = Range(1.6, 1.2, 1.8)
    rest = 450.0, 750.0
    sensors = (Sensor("T", 0, False, 0.1, 0.4),)
    friction = {"k": "plate"}  # noqa: RUF012

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


@dataclass(frozen=True)
class Winding(Balance):
    """Winding at a voltage: the coil of a drive at standstill."""

    L: float = 0.04  # inductance, H
    R: float = 1.6  # resistance of the cold winding, ohm
    lost: float = 0.0  # inductance that is lost at high currents, H
    knee: float = 1.0  # current at which much of it is lost, A
    stiffness: float = 4.0  # gain of the controller of the current, V/A

    limits = -12.0, 12.0
    name = "winding"
    input = "u"
    duration = 3.0
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


_RESISTANCE = 0.02  # ohm
_CHARGED = 3.3  # V


@dataclass(frozen=True)
class Cell(Balance):
    """Capacitor cell with measured current (positive: discharge); the voltage shows charge and resistance."""

    C: float = 20.0  # capacitance, F
    R: float = _RESISTANCE  # resistance, ohm, which the sensor sees
    stiffness: float = -20.0  # gain of the controller of the voltage, A/V

    limits = -8.0, 8.0
    name = "cell"
    input = "i"
    measured = True
    duration = 4.0
    range = Range(5.0, 2.0)
    rest = _CHARGED - 0.1, _CHARGED + 0.1
    sensors = (Sensor("U", 0, False, 2e-4, 5e-4, through=-_RESISTANCE),)

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
