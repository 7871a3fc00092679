"""Looks at two channels: a speed that is a multiple of a slope, a command that is logged as a measurement."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from unmodelled.base.arrays import Array, Indices
from unmodelled.logs.differentiate import quantum, smooth_derivative
from unmodelled.systems.model import System

#: Largest rest of a speed beside the multiple of a slope, in its root mean square, and largest difference of
#: the multiples of the runs, relative: a second sensor at another place of the machine differs by more.
REST, SAME = 0.1, 0.03
#: Smallest multiple, or its inverse, that no gain of a sensor explains.
FACTOR = 1.5
#: Rest of an output beside a multiple of an input, in its standard deviation (numbers are written with six
#: digits or more) and in counts of both; fewest counts of an output that may be coarse.
EXACT, COUNTS, FEWEST_COUNTS = 1e-4, 0.6, 50.0


@dataclass(frozen=True)
class Multiple:
    """A speed that is a multiple of the slope of its position."""

    position: int  # number of the output that shows it
    speed: int  # number of the output that should show it
    factor: float


def multiples(system: System, y: Array, offsets: Indices, period: float) -> Iterator[Multiple]:
    """Yield speeds of y (samples, outputs) that are a multiple of the slope of their position in all runs."""
    shown = {output.expression: k for k, output in enumerate(system.outputs)}
    for position, speed in zip(system.x, system.dynamics, strict=True):
        if position in shown and speed in shown and speed in system.x:
            p, v = shown[position], shown[speed]
            slope = smooth_derivative(y[:, p], offsets, period)[1]
            factor = _factor(slope, y[:, v], offsets)
            if factor is not None and abs(np.log(factor)) > np.log(FACTOR):
                yield Multiple(p, v, factor)


def _factor(slope: Array, speed: Array, offsets: Indices) -> float | None:
    """Return the one factor of a slope that gives the speed of all runs; None if there is none."""
    whole = float(slope @ slope)
    factor = float(slope @ speed) / whole if whole > 0.0 else 0.0
    rest = speed - factor * slope
    if factor <= 0.0 or rest @ rest > REST**2 * (speed @ speed):
        return None
    for a, b in pairwise(offsets):
        own = float(slope[a:b] @ slope[a:b])
        if own > REST * whole / (len(offsets) - 1) and (
            abs(float(slope[a:b] @ speed[a:b]) / own - factor) > SAME * factor
        ):
            return None
    return factor


def commands_as_outputs(system: System, y: Array, u: Array, offsets: Indices) -> dict[int, int]:
    """Return the outputs of y (samples, outputs) that are an input of u, times and plus constants.

    A command may be logged one sample earlier or later. An output whose expression has the input is none.
    """
    found = dict[int, int]()
    inner = np.ones(len(y), np.bool_)
    inner[offsets[:-1]] = inner[offsets[1:] - 1] = False
    rows = np.flatnonzero(inner)
    for j, output in enumerate(system.outputs):
        read = {each.name for each in output.expression.free_symbols}
        for k, item in enumerate(system.inputs):
            if item.name not in read and any(_is(y[rows, j], u[rows + late, k]) for late in (0, -1, 1)):
                found.setdefault(j, k)
    return found


def _is(output: Array, command: Array) -> bool:
    """Return whether an output is a multiple of a command plus a constant, down to rounding."""
    off, own = output - output.mean(), command - command.mean()
    size, count = float(np.std(output)), quantum(output)
    if size == 0.0 or own @ own == 0.0:
        return False
    factor = float(off @ own) / float(own @ own)
    rest, rounding = float(np.abs(off - factor * own).max()), EXACT * size
    counts = COUNTS * (count + abs(factor) * quantum(command))
    return rest < rounding or bool(size >= FEWEST_COUNTS * count and rest < rounding + counts)
