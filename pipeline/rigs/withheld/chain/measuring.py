"""The logs of a case with a measurement chain, and how much of the gap each planted effect makes."""

from collections.abc import Collection, Sequence
from itertools import chain
from typing import NamedTuple

import numpy as np

from pipeline.rigs.withheld.chain.case import MeasuredCase
from pipeline.rigs.withheld.chain.drive import ClosedLoop, Controller
from pipeline.rigs.withheld.chain.part import Part, Readings
from pipeline.rigs.withheld.effects.effect import Effect, Plan
from pipeline.rigs.withheld.experiments import TURN, Built, Experiments, Placed, along, built, seen
from pipeline.rigs.withheld.stepping import Control, Motion, follow, move
from unmodelled.base.arrays import Array


def with_chain(case: MeasuredCase, effects: Placed, parts: Sequence[Part]) -> Built:
    """Return the machine of `case` with `effects` (channel, effect) and the `parts` of a chain."""
    machine = case.machine
    for part in parts:
        machine = part.machine(machine)
    made, drive = built(machine, effects), chain.from_iterable(part.drive() for part in parts)
    return made._replace(drive=[*drive, *made.drive])


def planted(case: MeasuredCase, plan: Plan, without: Collection[int] = ()) -> list[tuple[str, Effect]]:
    """Return new objects of the planted effects as they are in this campaign, but for some by number."""
    found = []
    for k, (channel, effect) in enumerate(case.built(plan)):
        for part in case.chain:
            effect = part.effect(effect)
        if k not in without:
            found.append((channel, effect))
    return found


def moved(case: MeasuredCase, plan: Plan) -> Motion:
    """Simulate the runs of `case`."""
    rng = np.random.default_rng([case.seed, 2])
    t = plan.period * np.arange(plan.samples, dtype=np.float64)
    start = case.machine.start(plan.runs, rng)
    reference = along(t, case.motions.kinds, case.machine.range, rng)
    made = with_chain(case, planted(case, plan), case.chain)
    loops = [part for part in case.chain if isinstance(part, ClosedLoop)]
    control: Control | None = Controller(made.machine, loops[0], plan.period) if loops else None
    return move(made.machine, plan, reference, start, made.forces, made.drive, control)


def measured(case: MeasuredCase, plan: Plan, motion: Motion) -> Experiments:
    """Return the logs of a motion: exact outputs are those of the sensors, on the grid of the commands."""
    machine, effects = case.machine, planted(case, plan)
    t = np.tile(plan.period * np.arange(plan.samples, dtype=np.float64)[:, None], plan.runs)
    exact = seen(machine, plan, motion, effects)
    rng = np.random.default_rng([case.seed, 3])
    readings = Readings(t, motion.u, exact)
    for part in case.chain:
        readings = part.read(readings, rng)
    outputs = {}
    for sensor in machine.sensors:
        for part in case.chain:
            sensor = part.sensor(sensor)
        y = readings.outputs[sensor.output]
        y = y + sensor.noise * rng.standard_normal(y.shape)
        outputs[sensor.output] = sensor.quantum * np.round(y / sensor.quantum) if sensor.quantum > 0.0 else y
    readings = Readings(readings.t, readings.u, outputs)
    for part in case.chain:
        readings = part.processed(readings, machine, plan.period)
    wrapped = {s.output for s in machine.sensors if s.wraps}
    kept = {name: np.mod(y, TURN) if name in wrapped else y for name, y in readings.outputs.items()}
    return Experiments(plan, readings.t, readings.u, kept, {name: exact[name] for name in kept}, effects)


HORIZON = 0.1  # s, that of the shares; a diagnosis chooses its horizon from the logs


class Shares(NamedTuple):
    """Root mean square errors of free runs over `HORIZON`, in standard deviations of the logged outputs."""

    effects: float  # without any planted effect, with the true constants
    chain: float  # with all planted effects, without the measurement chain
    each: tuple[float, ...]  # without one planted effect, by effect

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
    left = with_chain(case, planted(case, plan, without), parts)
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
