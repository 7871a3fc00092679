"""Starting values of shapes, and a curve, that several families share."""

from __future__ import annotations

from math import pi

import numpy as np

from unmodelled.effects.law import Fixed, Law, Shape, neat, signed
from unmodelled.effects.place import Site

#: Of the rms speed: the least speed at which a fit of dry friction starts.
LEAST_CREEP = 1e-3


def geometric(low: float, high: float, count: int) -> tuple[float, ...]:
    """Return a geometric series of starting values, rounded to three digits."""
    return tuple(neat(value) for value in np.geomspace(low, max(high, 1.1 * low), count))


def inside(low: float, high: float, count: int) -> tuple[float, ...]:
    """Return equidistant values within an interval, without its ends."""
    return tuple(np.linspace(low, high, count + 2)[1:-1].tolist())


def creep(at: Site, holds: bool = True) -> Shape:
    """Return the speed below which dry friction falls to zero.

    It starts where friction of the missing effort's magnitude would stop the port within one sampling period.
    Where friction can hold the port over an integration step (see `systems.sticking`), it can fall until a
    held port creeps less in the longest experiment than it moves in one sampling period. It `holds` a port on
    whose own acceleration it acts.
    """
    start, speed = stopping(at), at["v"].rms
    least = start / 3.0
    if holds and "a" in at:
        least = min(least, neat(speed * at.period / at.duration))
    return Shape("v", (start,), (least, max(speed, 3.0 * start)))


def stopping(at: Site) -> float:
    """Return the speed that friction of the missing effort's magnitude stops within one sampling period."""
    return neat(max(at.effort * at.mobility * at.period, LEAST_CREEP * at["v"].rms))


def presliding(at: Site) -> Shape:
    """Return distances over which friction builds up, from two samples to a fifth of the half travel."""
    step = 2.0 * at["v"].rms * at.period
    travel = at["x"].half if "x" in at else at["v"].rms * at.duration
    grid = geometric(step, max(0.2 * travel, 10.0 * step), 4)
    return Shape(like="v*t" if "x" not in at else "x", grid=grid, bounds=(0.1 * grid[0], 10.0 * grid[-1]))


def relaxation(at: Site) -> Fixed:
    """Return one sampling period, the shortest time constant of a memory."""
    return Fixed("t", at.period)


def waves(at: Site, most: int, whole: bool = False) -> tuple[float, ...]:
    """Return spatial frequencies that the samples can resolve, in rad per unit of position.

    For an angle these are whole numbers of waves per turn, otherwise half waves over the travel.
    """
    angle = at.quantities["x"].unit == "rad"
    step = 1.0 if angle else pi / (2.0 * at["x"].half)
    first = 2 if whole and not angle else 1
    finest = pi / (2.0 * at["v"].rms * at.period) if "v" in at else most * step
    return tuple(step * k for k in range(first, most + 1) if k == first or step * k <= finest)


def polynomial(at: Site, letter: str, order: int) -> Law:
    """Return the law of any smooth function of position: a polynomial about the middle of the travel."""
    s = "((x - x_m)/x_r)"
    powers = {f"{letter}_{k}": "1" if k == 0 else s if k == 1 else f"{s}**{k}" for k in range(order + 1)}
    return Law(
        " + ".join(name if power == "1" else f"{name}*{power}" for name, power in powers.items()),
        {name: signed(power, at.effort) for name, power in powers.items()},
        fixed={"x_m": Fixed("x", at["x"].middle), "x_r": Fixed("x", at["x"].half)},
        fitted_along="x",
    )
