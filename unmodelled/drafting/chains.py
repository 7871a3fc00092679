"""Several sensors of one chain: encoders on both sides of a gear, speeds of other shafts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from unmodelled.drafting.channels import CLOSE, SAMPLES, Channel, plain, position_channel, slope
from unmodelled.drafting.columns import Signal
from unmodelled.drafting.motion import at
from unmodelled.drafting.names import ACTING, Role, number_of
from unmodelled.drafting.units import dimension_of, is_angle, is_speed
from unmodelled.logs.differentiate import noise, quantum

#: Share of its motion by which a position on one chain may differ from another one: springs, plays, filters.
SLACK = 0.05
#: Size of what differs between two sensors of one level, in that of noise.
WHITE = 2.0
#: Correlation from which on a column is the speed of a position, times a factor.
CERTAIN = 0.95


def chained(signal: Signal, other: Signal, signals: Sequence[Signal]) -> float:
    """Return how many times another position one is, if both are of one chain; 0 if they are not.

    Positions that move alike, each with a drive of its own number, are two joints that were moved alike.
    """
    t = signal.t[:SAMPLES]
    a, b = plain(signal)[: len(t)], at(t, other.t, plain(other))
    a, b = a - a.mean(), b - b.mean()
    ratio = float(a @ b) / float(b @ b) if b.any() else 0.0
    if ratio == 0.0 or np.std(a - ratio * b) > SLACK * np.std(a):
        return 0.0
    numbers = {number_of(s.address) for s in signals if s.role in ACTING or s.role is Role.GOAL}
    own = {number_of(signal.address), number_of(other.address)}
    return 0.0 if len(own) > 1 and own <= numbers else ratio


def copied(signal: Signal, other: Signal) -> float:
    """Return how many times another level one is, if only noise is between them; 0 if they are two levels."""
    t = signal.t[:SAMPLES]
    a, b = signal.values[: len(t)], at(t, other.t, other.values)
    a, b = a - a.mean(), b - b.mean()
    ratio = float(a @ b) / float(b @ b) if b.any() else 0.0
    between = a - ratio * b
    few = max(WHITE * noise(between), quantum(between), 1e-6 * float(np.std(a)))
    return ratio if float(np.std(between)) <= min(few, SLACK * float(np.std(a))) else 0.0


def geared(position: Signal, velocity: Signal) -> float:
    """Return how many times the slope of a position a speed is, both in known units; 0 if it is the slope."""
    if position.unit is None or velocity.unit is None or not is_speed(velocity.unit):
        return 0.0
    here = position_channel(position, None, 0.0)
    kind = "rad/s" if is_angle(here.unit) else "m/s"
    if here.question or dimension_of(velocity.unit) != dimension_of(kind):
        return 0.0
    found = slope(position, velocity)
    ratio = abs(found.ratio) * Channel(velocity, velocity.unit, True).size / here.size
    return ratio if abs(found.correlation) >= CERTAIN and abs(np.log(max(ratio, 1e-9))) > CLOSE else 0.0
