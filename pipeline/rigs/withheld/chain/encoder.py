"""Encoders with few counts per turn: positions are plateaus."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.rigs.withheld.chain.part import Part
from pipeline.rigs.withheld.machine import Sensor

COARSER = 2.0, 16.0
#: Noise of the edges of a count, in counts.
EDGE = 0.05


@dataclass(frozen=True)
class CoarseEncoder(Part):
    """Positions in counts that are `factor` times as wide as those of the machine's encoder.

    Attributes:
        factor: width of a count relative to the encoder of the machine.
    """

    factor: float

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> CoarseEncoder:
        """Draw an encoder."""
        return cls(float(np.exp(rng.uniform(*np.log(COARSER)))))

    def sensor(self, sensor: Sensor) -> Sensor:
        if sensor.rate:
            return sensor
        count = self.factor * sensor.quantum
        return sensor._replace(quantum=count, noise=EDGE * count)
