"""The logs of a case with a measurement chain: motion, sensors, clock, noise and counts, calculations."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np

from pipeline.rigs.withheld.chain.case import MeasuredCase
from pipeline.rigs.withheld.chain.closed_loop import ClosedLoop, Controller
from pipeline.rigs.withheld.chain.part import Part, Readings
from pipeline.rigs.withheld.effects.effect import (
    ActuatorEffect,
    Effect,
    Plan,
    PortEffect,
)
from pipeline.rigs.withheld.effects.friction import DryFriction
from pipeline.rigs.withheld.experiments import TURN, Experiments, along, seen
from pipeline.rigs.withheld.machine import Machine
from pipeline.rigs.withheld.stepping import Control, Motion, move

Placed = Sequence[tuple[str, Effect]]


@dataclass(frozen=True)
class Built:
    """A machine with what acts on it; the effects are new objects, which remember one simulation.

    Attributes:
        machine: machine with its built-in effects.
        forces: port and force of every planted force; smooth forces come before forces that project
            velocities.
        drive: distortions of the command, in the order of the signal.
    """

    machine: Machine
    forces: list[tuple[str, PortEffect]]
    drive: list[ActuatorEffect]


def built(case: MeasuredCase, plan: Plan, effects: Placed, parts: Sequence[Part]) -> Built:
    """Return the machine of `case` with `effects` (channel, effect) and the `parts` of a chain."""
    machine = case.machine
    for part in parts:
        machine = part.machine(machine)
    for _, effect in effects:
        machine = effect.refitted(machine)
    forces = [(channel, effect) for channel, effect in effects if isinstance(effect, PortEffect)]
    forces.sort(key=lambda force: isinstance(force[1], DryFriction))
    drive = [*chain.from_iterable(part.drive() for part in parts)]
    return Built(machine, forces, drive + [e for _, e in effects if isinstance(e, ActuatorEffect)])


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
    made = built(case, plan, planted(case, plan), case.chain)
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
