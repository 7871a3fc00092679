"""A controller that reads an encoder, and not the state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.arrays import Array
from pipeline.rigs.withheld.chain.part import Part
from pipeline.rigs.withheld.machine import Conditions, Machine

FILTER = 0.003, 0.008  # s


@dataclass(frozen=True)
class ClosedLoop(Part):
    """Controller of the input, from a set point and encoder positions.

    The speed is the difference of two positions after a low-pass of first order with the time constant
    `filter` (s), so that counts reach the input.

    Attributes:
        filter: time constant of the low-pass of the speed, s.
    """

    filter: float

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> ClosedLoop:
        """Draw the filter of the speed."""
        return cls(float(rng.uniform(*FILTER)))


class Controller:
    """Calls `machine.regulated` once per sample of `period` s; it remembers one simulation.

    Args:
        machine: machine with its constants.
        loop: part of the measurement chain with the filter.
        period: sampling period, s.
    """

    def __init__(self, machine: Machine, loop: ClosedLoop, period: float) -> None:
        self.machine, self.period = machine, period
        self.keep = np.exp(-period / loop.filter)
        counts = {s.row: s.quantum for s in machine.sensors if not s.rate}
        self.counts = np.array([counts[row] for row in sorted(counts)])[:, None]
        self.last: tuple[Array, Array] | None = None

    def __call__(self, reference: Array, slope: Array, q: Array, v: Array, c: Conditions) -> Array:
        """Return the command (n,) at true positions and velocities (d, n)."""
        shown = self.counts * np.round(q / self.counts)
        before, speed = (shown, np.zeros_like(shown)) if self.last is None else self.last
        speed = self.keep * speed + (1.0 - self.keep) * (shown - before) / self.period
        self.last = shown, speed
        return self.machine.regulated(reference, slope, shown, speed, c)
