"""Machines without inertia with two levels: tanks, a heated block, a converter, a valve with a chamber."""

from dataclasses import dataclass

import numpy as np

from pipeline.rigs.withheld.balance import Balance
from pipeline.rigs.withheld.effects import actuators, flows, foreign, sensors
from pipeline.rigs.withheld.effects.effect import Plantable as P
from pipeline.rigs.withheld.machine import Range, Sensor
from unmodelled.base.arrays import Array


@dataclass(frozen=True)
class CoupledTanks(Balance):
    """Two tanks with a pipe between them: a pump fills the first one, the second one empties."""

    A: float = 2e-4  # cross-section of each tank, m^2
    k_p: float = 3e-5  # flow of the pump per voltage, m^3/(s V)
    k_c: float = 1e-3  # flow through the pipe per difference of the levels, m^2/s
    k_s: float = 2.74e-4  # flow through the outlet at a level of 1 m, m^2.5/s
    stiffness: float = 20.0  # gain of the controller of the first level, V/m

    limits = 0.0, 10.0
    ports = "first", "second"
    name = "coupled_tanks"
    input = "u"
    periods = (0.002, 0.004)
    duration = 6.0
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


_AROUND = 293.0  # K


@dataclass(frozen=True)
class HeatedBlock(Balance):
    """Heating wire in a block: two thermal masses, of which the block loses heat."""

    C1: float = 1.5e-3  # heat capacity of the wire, J/K
    C2: float = 4e-3  # heat capacity of the block, J/K
    k_c: float = 0.012  # conductance between wire and block, W/K
    k: float = 8e-3  # conductance between block and surroundings, W/K
    stiffness: float = 8e-3  # gain of the controller of the wire's temperature, W/K

    limits = 0.0, 5.0
    ports = "wire", "block"
    name = "heated_block"
    input = "P"
    periods = (0.001, 0.002, 0.004)
    duration = 5.0
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


@dataclass(frozen=True)
class BuckConverter(Balance):
    """Step-down converter, averaged over its switching, with resistive load; the input is the duty cycle."""

    V: float = 24.0  # supply, V
    L: float = 0.02  # inductance of the coil, H
    R: float = 0.5  # resistance of coil and switches, ohm
    C: float = 2e-3  # capacitance, F
    R_o: float = 5.0  # resistance of the load, ohm
    lost: float = 0.0  # inductance that is lost at high currents, H
    knee: float = 1.0  # current at which much of it is lost, A
    stiffness: float = 0.02  # gain of the controller of the voltage, 1/V

    limits = 0.0, 1.0
    ports = "capacitor", "coil"
    name = "buck_converter"
    input = "duty"
    periods = (0.001,)
    duration = 2.0
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


@dataclass(frozen=True)
class ServoValve(Balance):
    """Pneumatic valve whose spool follows its command with a lag, and the chamber that it fills.

    Pressures are relative to that of the surroundings.
    """

    C: float = 1.5e-8  # stored volume per pressure, m^3/Pa
    k_v: float = 0.04  # flow of the open valve at the pressure of the supply, m^3/s
    p_s: float = 6e5  # pressure of the supply, Pa
    k_o: float = 6e-8  # flow of the throttle at the outlet per pressure, m^3/(s Pa)
    tau: float = 0.03  # time constant of the spool, s
    k_u: float = 0.1  # opening per voltage, 1/V
    stiffness: float = 1e-5  # gain of the controller of the pressure, V/Pa

    limits = 0.0, 10.0
    ports = "gas", "spool"
    name = "servo_valve"
    input = "u"
    duration = 4.0
    range = Range(3.5, 2.5, 5.0)
    sensors = (Sensor("p", 0, False, 60.0, 200.0), Sensor("s", 1, False, 5e-4, 1e-3))
    friction = {"k_o": "gas"}  # noqa: RUF012
    doubtful = {"C": ("storage",)}  # noqa: RUF012

    def start(self, runs: int, rng: np.random.Generator) -> Array:
        return np.stack([rng.uniform(1.5e5, 3.5e5, runs), rng.uniform(0.3, 0.6, runs)])

    def flow(self, level: Array, u: Array) -> Array:
        p, s = level
        filled = self.k_v * s * np.sqrt(np.maximum(1.0 - p / self.p_s, 0.0))
        return np.stack([filled - self.k_o * p, self.k_u * u - s])

    def capacity(self, level: Array) -> Array:
        return np.array([[self.C], [self.tau]])

    def at_rest(self, u: Array) -> Array:
        most = (self.k_v * self.k_u * u / self.k_o) ** 2 / self.p_s
        return 0.5 * (np.sqrt(most**2 + 4.0 * most * self.p_s) - most)

    plantable = (
        P("root_outflow", "gas", lambda a, *_: flows.Orifice(3e-3 * a, 2.5e5, 3e3)),
        P("linear_loss", "gas", lambda a, *_: flows.Gap(1.2e-8 * a, 3e-7)),
        P("overflow", "gas", lambda a, *_: flows.ReliefValve(4e-8 * a, 2.6e5, 4e3)),
        P("storage", "gas", lambda a, *_: flows.SecondStore(3e-8 * a, 1.5e-8 * a, 5e4)),
        P("actuator_offset", "actuator:u", lambda a, *_: actuators.Offset(0.2 * a)),
        P("actuator_dead_zone", "actuator:u", lambda a, *_: actuators.RoundedDeadZone(0.5 * a)),
        P("actuator_asymmetry", "actuator:u", lambda a, *_: actuators.UnequalSides(min(0.05 * a, 0.3), 2.0),
          (("actuator_gain", "actuator:u"),)),
        P("input_delay", "actuator:u", lambda a, *_: actuators.Transport(0.012 * a)),
        P("actuator_rate_limit", "actuator:u", lambda a, *_: actuators.SlowAmplifier(25.0 / a)),
        P("sensor_gain", "sensor:s", lambda a, *_: sensors.ScaleError(0.05 * a)),
        P("sensor_lag", "sensor:p", lambda a, *_: sensors.LowPass(0.03 * a), (("sensor_delay", "sensor:p"),)),
        P("sticky_valve", "actuator:u", lambda a, *_: foreign.StickyValve(0.4 * a)),
    )  # fmt: skip
