"""Starting values that families share."""

from __future__ import annotations

from math import pi

import numpy as np

from unmodelled.effects.law import Fixed, Shape, neat
from unmodelled.effects.place import Site

#: Of the rms speed: the least at which dry friction is fully there, whatever the data.
LEAST_CREEP = 1e-3


def geometric(low: float, high: float, count: int) -> tuple[float, ...]:
    """`count` values from `low` to `high`, each the same factor above the last."""
    return tuple(neat(value) for value in np.geomspace(low, max(high, 1.1 * low), count))


def inside(low: float, high: float, count: int) -> tuple[float, ...]:
    """`count` values that share the interval evenly, its ends left out."""
    return tuple(np.linspace(low, high, count + 2)[1:-1].tolist())


def creep(at: Site) -> Shape:
    """The speed below which dry friction falls to zero, so that a simulation can step over the corner.

    At this speed friction of the size that is lacking would stop the port within one sample.
    """
    speed = at["v"].rms
    least = neat(max(at.effort * at.mobility * at.period, LEAST_CREEP * speed))
    return Shape("v", (least,), (least / 3.0, max(speed, 3.0 * least)))


def presliding(at: Site) -> Shape:
    """Distances over which friction builds up: from some samples' worth to a part of the travel."""
    step = 2.0 * at["v"].rms * at.period
    travel = at["x"].half if "x" in at else at["v"].rms * at.duration
    grid = geometric(step, max(0.2 * travel, 10.0 * step), 4)
    return Shape(like="v*t" if "x" not in at else "x", grid=grid, bounds=(0.1 * grid[0], 10.0 * grid[-1]))


def relaxation(at: Site) -> Fixed:
    """One sampling period: the shortest time in which a memory may follow."""
    return Fixed("t", at.period)


def waves(at: Site, most: int, whole: bool = False) -> tuple[float, ...]:
    """Up to `most` spatial frequencies, in radians per unit of position, that samples can resolve.

    Whole numbers per turn where the position is an angle, else half waves over the travel.

    Args:
        whole: from a whole wave over the travel on: less of one looks like a spring.
    """
    angle = at.quantities["x"].unit == "rad"
    step = 1.0 if angle else pi / (2.0 * at["x"].half)
    first = 2 if whole and not angle else 1
    finest = pi / (2.0 * at["v"].rms * at.period) if "v" in at else most * step
    return tuple(step * k for k in range(first, most + 1) if k == first or step * k <= finest)
