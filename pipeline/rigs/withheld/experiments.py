"""The logs of a case: motion, then sensors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.rigs.withheld.cases import Case
from pipeline.rigs.withheld.effects.effect import ActuatorEffect, Effect, Plan, PortEffect, SensorEffect
from pipeline.rigs.withheld.effects.friction import DryFriction
from pipeline.rigs.withheld.machine import Sensor
from pipeline.rigs.withheld.references import references
from pipeline.rigs.withheld.stepping import Motion, move

Array = NDArray[np.float64]
TURN = 2.0 * np.pi


@dataclass(frozen=True)
class Experiments:
    """The n runs of a case.

    Attributes:
        plan: of the runs. t: (samples,) s. u: (samples, n) as commanded.
        outputs: by name, (samples, n) as logged.
        exact: the same without noise and steps, with the sensors' planted faults.
        effects: (channel, effect) of everything that is planted.
    """

    plan: Plan
    t: Array
    u: Array
    outputs: dict[str, Array]
    exact: dict[str, Array]
    effects: list[tuple[str, Effect]]


def run(case: Case, plan: Plan | None = None) -> Experiments:
    """Simulate and log the runs of `case`, by its own plan unless one is given."""
    plan = case.plan() if plan is None else plan
    effects = case.built(plan)
    motion = _moved(case, plan, effects)
    exact: dict[str, Array] = {}
    outputs: dict[str, Array] = {}
    noise = np.random.default_rng([case.seed, 3])
    for sensor in case.machine.sensors:
        y = (motion.v if sensor.rate else motion.q)[:, sensor.row]
        for channel, effect in effects:
            if channel == f"sensor:{sensor.output}" and isinstance(effect, SensorEffect):
                y = effect.seen(plan.period, y)
        shown = _shown(sensor, y, noise)
        if sensor.output in case.logged:
            exact[sensor.output], outputs[sensor.output] = y, shown
    t = plan.period * np.arange(plan.samples, dtype=np.float64)
    return Experiments(plan, t, motion.u, outputs, exact, effects)


def _moved(case: Case, plan: Plan, effects: list[tuple[str, Effect]]) -> Motion:
    machine, rng = case.machine, np.random.default_rng([case.seed, 2])
    t = plan.period * np.arange(plan.samples, dtype=np.float64)
    start = machine.start(plan.runs, rng)
    reference = references(t, plan.runs, machine.range, rng)
    for _, effect in effects:
        machine = effect.refitted(machine)
    forces = [(channel, effect) for channel, effect in effects if isinstance(effect, PortEffect)]
    forces.sort(key=lambda force: isinstance(force[1], DryFriction))
    drive = [effect for _, effect in effects if isinstance(effect, ActuatorEffect)]
    return move(machine, plan, reference, start, forces, drive)


def _shown(sensor: Sensor, y: Array, rng: np.random.Generator) -> Array:
    shown = y + sensor.noise * rng.standard_normal(y.shape)
    if sensor.quantum > 0.0:
        shown = sensor.quantum * np.round(shown / sensor.quantum)
    return np.mod(shown, TURN) if sensor.wraps else shown
