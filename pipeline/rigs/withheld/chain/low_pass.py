"""Filters of the logger."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import butter, sosfilt, sosfilt_zi

from pipeline.arrays import Array
from pipeline.rigs.withheld.chain.part import Names, Part, Readings
from pipeline.rigs.withheld.machine import Machine

CUT_OFF = 20.0, 120.0  # Hz
#: Of the sampling frequency, the highest cut-off.
HIGHEST = 0.4


@dataclass(frozen=True)
class LowPass(Part):
    """Outputs pass a Butterworth filter of second order at `cut_off` Hz; the input, too, if `whole`.

    Attributes:
        cut_off: cut-off frequency, Hz.
        whole: whether the input passes the filter, too.
    """

    cut_off: float
    whole: bool

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> LowPass:
        """Draw a filter."""
        return cls(float(np.exp(rng.uniform(*np.log(CUT_OFF)))), bool(rng.uniform() < 0.5))

    def processed(self, readings: Readings, machine: Machine, period: float) -> Readings:
        outputs = {name: self.filtered(y, period) for name, y in readings.outputs.items()}
        u = self.filtered(readings.u, period) if self.whole else readings.u
        return replace(readings, u=u, outputs=outputs)

    def filtered(self, y: Array, period: float) -> Array:
        """Return signals (samples, n) after the filter, which was at rest at their first value.

        Takes y (samples, n), period in s; gives (samples, n).
        """
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
