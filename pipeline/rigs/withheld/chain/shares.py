"""How much of the gap each planted effect makes: it is removed and the machine runs again."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import NamedTuple

import numpy as np

from pipeline.arrays import Array
from pipeline.rigs.withheld.chain.case import MeasuredCase
from pipeline.rigs.withheld.chain.measuring import built, planted
from pipeline.rigs.withheld.chain.part import Part
from pipeline.rigs.withheld.effects.effect import Plan
from pipeline.rigs.withheld.experiments import seen
from pipeline.rigs.withheld.stepping import Motion, follow

HORIZON = 0.1  # s, that of the shares; a diagnosis chooses its horizon from the logs


class Shares(NamedTuple):
    """Root mean square errors of free runs over `HORIZON`, in standard deviations of the logged outputs.

    Attributes:
        effects: error of the machine without any planted effect, with its true constants.
        chain: error of the machine with all planted effects and without the measurement chain.
        each: error of the machine without one planted effect, by effect.
    """

    effects: float
    chain: float
    each: tuple[float, ...]

    @property
    def shares(self) -> tuple[float, ...]:
        """Squares of `each` relative to that of `effects`."""
        return tuple((one / self.effects) ** 2 if self.effects > 0.0 else 0.0 for one in self.each)


def shares(case: MeasuredCase, plan: Plan, motion: Motion) -> Shares:
    """Remove effects and the chain, and compare free runs with the motion.

    A run starts every `HORIZON` seconds at the state that the sensors show, as the diagnosis does it, and has
    the commands of `motion`. There is no noise.
    """
    every = range(len(case.effects))
    return Shares(
        _error(case, plan, motion, every, case.chain),
        _error(case, plan, motion, (), ()),
        tuple(_error(case, plan, motion, (k,), case.chain) for k in every),
    )


def _error(
    case: MeasuredCase, plan: Plan, motion: Motion, without: Collection[int], parts: Sequence[Part]
) -> float:
    removed = planted(case, plan, [k for k in range(len(case.effects)) if k not in without])
    shown = seen(case.machine, plan, motion, removed)
    start = _states(case, motion, shown)
    left = built(case, plan, planted(case, plan, without), parts)
    steps = max(1, round(HORIZON / plan.period))
    followed = follow(left.machine, plan, start, steps, left.forces, left.drive)
    found = seen(case.machine, plan, followed, ())
    squares = [np.mean((found[name] - shown[name]) ** 2) / _variance(shown[name]) for name in case.logged]
    return float(np.sqrt(np.mean(squares)))


def _states(case: MeasuredCase, motion: Motion, shown: dict[str, Array]) -> Motion:
    """The motion as the sensors show it."""
    q, v = motion.q.copy(), motion.v.copy()
    for sensor in case.machine.sensors:
        (v if sensor.rate else q)[:, sensor.row] = shown[sensor.output] - sensor.through * motion.u
    return Motion(q, v, motion.u)


def _variance(y: Array) -> float:
    return float(np.mean((y - y.mean(axis=0)) ** 2))
