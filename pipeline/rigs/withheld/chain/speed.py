"""Speeds without a tachometer: differences of positions, or no speed at all."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import lfilter

from pipeline.arrays import Array
from pipeline.rigs.withheld.chain.part import Names, Part, Readings
from pipeline.rigs.withheld.machine import Machine

WINDOW = 0.004, 0.02  # s
CUT_OFF = 15.0, 80.0  # Hz


def differenced(position: Array, period: float, window: int, centred: bool) -> Array:
    """Return the mean speed over `window` periods, (samples, n), from positions (samples, n).

    The window ends at the sample, or lies around it if `centred`; it is shorter at the ends of a run.

    Takes position (samples, n), period in s; gives (samples, n).
    """
    last = len(position) - 1
    k = np.arange(last + 1)
    after = window // 2 if centred else 0
    end = np.maximum(np.minimum(k + after, last), 1)
    begin = np.clip(k + after - window, 0, end - 1)
    return np.asarray((position[end] - position[begin]) / (period * (end - begin)[:, None]))


@dataclass(frozen=True)
class DifferencedSpeed(Part):
    """Speeds are differences of the logged positions over `window` s, then a low-pass of first order at
    `cut_off` Hz (0: none). `centred`: computed after the run, without latency.

    Attributes:
        window: width of the difference, s.
        cut_off: cut-off frequency of the low-pass of first order, Hz; 0: no low-pass.
        centred: whether the window lies around the sample; otherwise it ends there.
    """

    window: float
    cut_off: float
    centred: bool

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> DifferencedSpeed:
        """Draw window and cut-off; a speed of the drive's controller has a latency."""
        window = float(np.exp(rng.uniform(*np.log(WINDOW))))
        centred = bool(rng.uniform() < 0.5)
        filtered = not centred and rng.uniform() < 0.5
        return cls(window, float(np.exp(rng.uniform(*np.log(CUT_OFF)))) if filtered else 0.0, centred)

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
