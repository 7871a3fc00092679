"""Parts of the chain behind the machine: encoders, speeds, filters, and the clock of the logger."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import butter, lfilter, sosfilt, sosfilt_zi

from pipeline.rigs.withheld.chain.part import Names, Part, Readings
from pipeline.rigs.withheld.machine import Machine, Sensor
from unmodelled.base.arrays import Array

JITTER = 0.01, 0.08  # rms, in periods
FASTEST = 1e-3


@dataclass(frozen=True)
class Clock(Part):
    """Clock of the logger, whose samples lie beside the grid."""

    jitter: float  # rms, periods
    fast: float  # share by which time runs fast
    stamped: bool  # the log has the instants of the samples; otherwise it has the uniform grid

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> Self:
        """Draw a clock."""
        return cls(float(rng.uniform(*JITTER)), float(rng.uniform(0.0, FASTEST)), bool(rng.uniform() < 0.5))

    def read(self, readings: Readings, rng: np.random.Generator) -> Readings:
        grid = readings.t[:, 0]
        period = grid[1] - grid[0]
        # a third of a period at most, so that no sample overtakes another
        off = np.clip(self.jitter * rng.standard_normal(readings.t.shape), -0.33, 0.33)
        instants = np.clip(readings.t + period * off, grid[0], grid[-1])
        outputs = {name: _at(grid, y, instants) for name, y in readings.outputs.items()}
        stamps = (instants if self.stamped else readings.t) * (1.0 + self.fast)
        return replace(readings, t=stamps, outputs=outputs)


def _at(grid: np.ndarray, y: np.ndarray, instants: np.ndarray) -> np.ndarray:
    return np.stack([CubicSpline(grid, y[:, i])(instants[:, i]) for i in range(y.shape[1])], axis=1)


COARSER = 2.0, 16.0
#: Noise of the edges of a count, in counts.
EDGE = 0.05


@dataclass(frozen=True)
class CoarseEncoder(Part):
    """Positions in counts that are `factor` times as wide as those of the machine's encoder."""

    factor: float

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> Self:
        """Draw an encoder."""
        return cls(float(np.exp(rng.uniform(*np.log(COARSER)))))

    def sensor(self, sensor: Sensor) -> Sensor:
        if sensor.rate:
            return sensor
        count = self.factor * sensor.quantum
        return sensor._replace(quantum=count, noise=EDGE * count)


WINDOW = 0.004, 0.02  # s
SPEED_CUT_OFF = 15.0, 80.0  # Hz


def differenced(position: Array, period: float, window: int, centred: bool) -> Array:
    """Return the mean speed over `window` periods, (samples, n), from positions (samples, n).

    The window ends at the sample, or lies around it if `centred`; it is shorter at the ends of a run.
    """
    last = len(position) - 1
    k = np.arange(last + 1)
    after = window // 2 if centred else 0
    end = np.maximum(np.minimum(k + after, last), 1)
    begin = np.clip(k + after - window, 0, end - 1)
    return np.asarray((position[end] - position[begin]) / (period * (end - begin)[:, None]))


@dataclass(frozen=True)
class DifferencedSpeed(Part):
    """Speeds are differences of the logged positions, then pass a low-pass of first order."""

    window: float  # width of the difference, s
    cut_off: float  # Hz; 0: no low-pass
    centred: bool  # the window lies around the sample, computed after the run; else it ends there

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> Self:
        """Draw window and cut-off; a speed of the drive's controller has a latency."""
        window = float(np.exp(rng.uniform(*np.log(WINDOW))))
        centred = bool(rng.uniform() < 0.5)
        filtered = not centred and rng.uniform() < 0.5
        return cls(window, float(np.exp(rng.uniform(*np.log(SPEED_CUT_OFF)))) if filtered else 0.0, centred)

    def processed(self, readings: Readings, machine: Machine, period: float) -> Readings:
        window = max(1, round(self.window / period))
        positions = {s.row: readings.outputs[s.output] for s in machine.sensors if not s.rate}
        outputs = dict(readings.outputs)
        for sensor in machine.sensors:
            if sensor.rate:
                speed = differenced(positions[sensor.row], period, window, self.centred)
                outputs[sensor.output] = self._filtered(speed, period)
        return replace(readings, outputs=outputs)

    def _filtered(self, speed: Array, period: float) -> Array:
        if self.cut_off == 0.0:
            return speed
        keep = np.exp(-2.0 * np.pi * self.cut_off * period)
        return np.asarray(lfilter([1.0 - keep], [1.0, -keep], speed, axis=0, zi=keep * speed[:1])[0])

    def names(self, machine: Machine, logged: tuple[str, ...]) -> Names:
        speeds = [s.output for s in machine.sensors if s.rate and s.output in logged]
        families = () if self.centred else ("sensor_delay", "sensor_lag")
        return tuple((family, f"sensor:{name}") for name in speeds for family in families)


@dataclass(frozen=True)
class PositionOnly(Part):
    """No speed is logged."""

    def processed(self, readings: Readings, machine: Machine, period: float) -> Readings:
        positions = {s.output for s in machine.sensors if not s.rate}
        kept = {name: y for name, y in readings.outputs.items() if name in positions}
        return replace(readings, outputs=kept)


CUT_OFF = 20.0, 120.0  # Hz
#: Of the sampling frequency, the highest cut-off.
HIGHEST = 0.4


@dataclass(frozen=True)
class LowPass(Part):
    """Outputs pass a Butterworth filter of second order."""

    cut_off: float  # Hz
    whole: bool  # the input passes it, too

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> Self:
        """Draw a filter."""
        return cls(float(np.exp(rng.uniform(*np.log(CUT_OFF)))), bool(rng.uniform() < 0.5))

    def processed(self, readings: Readings, machine: Machine, period: float) -> Readings:
        outputs = {name: self.filtered(y, period) for name, y in readings.outputs.items()}
        u = self.filtered(readings.u, period) if self.whole else readings.u
        return replace(readings, u=u, outputs=outputs)

    def filtered(self, y: Array, period: float) -> Array:
        """Return signals (samples, n) after the filter, which was at rest at their first value."""
        sections = butter(2, min(self.cut_off, HIGHEST / period), fs=1.0 / period, output="sos")
        start = sosfilt_zi(sections)[:, :, None] * y[:1][None]
        return np.asarray(sosfilt(sections, y, axis=0, zi=start)[0])

    def names(self, machine: Machine, logged: tuple[str, ...]) -> Names:
        if self.whole:
            return ()
        # all outputs late by the same time: the input acts late
        late = tuple((family, f"actuator:{machine.input}") for family in ("input_delay", "actuator_lag"))
        families = "sensor_lag", "sensor_delay"
        return (*late, *((family, f"sensor:{name}") for family in families for name in logged))
