"""Simulate the logs of a case: motion first, then sensors."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pipeline.rigs.withheld.cases import Case
from pipeline.rigs.withheld.effects.effect import ActuatorEffect, Effect, Plan, PortEffect, SensorEffect
from pipeline.rigs.withheld.effects.friction import DryFriction
from pipeline.rigs.withheld.machine import Conditions, Machine, Range, Sensor
from pipeline.rigs.withheld.stepping import Motion, move
from unmodelled.base.arrays import Array

#: Channel and effect of planted effects.
Placed = Sequence[tuple[str, Effect]]
TURN = 2.0 * np.pi
_SLOWEST = 0.3  # Hz
#: Times, s, and the highest frequency, Hz -> a signal between -1 and 1.
Kind = Callable[[Array, float, np.random.Generator], Array]


def references(t: Array, runs: int, extent: Range, rng: np.random.Generator) -> Array:
    """Draw smooth reference signals (samples, runs); all kinds occur in turn, in random order."""
    order = rng.permutation(np.arange(runs) % len(KINDS))
    kinds = [*KINDS.values()]
    return along(t, [kinds[kind] for kind in order.tolist()], extent, rng)


def along(t: Array, kinds: Sequence[Kind], extent: Range, rng: np.random.Generator) -> Array:
    """Return a reference signal of every kind, (samples, kinds), from rest at times `t` (samples,), s."""
    columns = []
    for kind in kinds:
        wave = kind(t, extent.band, rng)
        size = extent.amplitude * rng.uniform(0.55, 1.0) * rng.choice([-1.0, 1.0])
        columns.append(size * wave * smooth(t / min(0.25, 0.2 * t[-1])))
    return extent.centre + np.stack(columns, axis=1)


def _waves(t: Array, band: float, rng: np.random.Generator) -> Array:
    frequencies = np.geomspace(_SLOWEST, band, 5) * rng.uniform(0.85, 1.15, 5)
    waves = np.sin(TURN * np.multiply.outer(t, frequencies) + rng.uniform(0.0, TURN, 5))
    total = waves @ (frequencies / _SLOWEST) ** -0.7
    return np.asarray(total / np.max(np.abs(total)))


def _sweep(t: Array, band: float, rng: np.random.Generator) -> Array:
    growth = np.log(band / _SLOWEST) / t[-1]
    phase = TURN * _SLOWEST * np.expm1(growth * t) / growth
    return np.asarray(np.sin(phase + rng.uniform(-0.5, 0.5)) * np.exp(-0.6 * growth * t))


def _moves(t: Array, band: float, rng: np.random.Generator) -> Array:
    """Return moves from rest to rest, with pauses."""
    stops, rise = max(3, round(1.2 * t[-1])), 0.6 / band
    begin = (np.arange(stops) + rng.uniform(0.0, 0.3, stops)) * t[-1] / stops
    levels = rng.uniform(0.4, 1.0, stops) * (-1.0) ** np.arange(stops)
    steps = np.diff(levels, prepend=0.0)
    return sum((s * smooth((t - b) / rise) for s, b in zip(steps, begin, strict=True)), np.zeros_like(t))


def _reversals(t: Array, band: float, rng: np.random.Generator) -> Array:
    """Ramps at an even speed that turn round sharply, but not at once."""
    phase = TURN * 0.4 * band * t + rng.uniform(0.0, TURN)
    return np.asarray(np.arcsin(0.97 * np.sin(phase)) / np.arcsin(0.97))


def _pauses(t: Array, band: float, rng: np.random.Generator) -> Array:
    """Waves that die down, a pause, and waves again."""
    middle, half, edge = rng.uniform(0.45, 0.65) * t[-1], 0.12 * t[-1], 0.08 * t[-1]
    away = np.abs(t - middle) - half
    return _waves(t, band, rng) * smooth(away / edge)


#: Kinds of motion by name.
KINDS: Mapping[str, Kind] = {
    "waves": _waves,
    "sweep": _sweep,
    "moves": _moves,
    "reversals": _reversals,
    "pauses": _pauses,
}


def smooth(s: Array) -> Array:
    """Return a transition (any shape) from 0 to 1 with a continuous third derivative."""
    s = np.clip(s, 0.0, 1.0)
    return np.asarray(s**4 * (35.0 - 84.0 * s + 70.0 * s**2 - 20.0 * s**3))


@dataclass(frozen=True)
class Experiments:
    """The n runs of a case."""

    plan: Plan
    t: Array  # (samples, n), s
    u: Array  # (samples, n), commanded
    outputs: dict[str, Array]  # (samples, n) each, logged
    exact: dict[str, Array]  # (samples, n) each, without noise and resolution, but with planted sensor faults
    effects: list[tuple[str, Effect]]  # channel and effect of every planted effect


def run(case: Case, plan: Plan | None = None, commands: Array | None = None) -> Experiments:
    """Simulate and log the runs of a case. Takes commands (samples, n)."""
    plan = case.plan() if plan is None else plan
    effects, more = case.built(plan), () if commands is None else (1,)
    motion = _moved(case, plan, effects, commands, np.random.default_rng([case.seed, 2, *more]))
    noise = np.random.default_rng([case.seed, 3, *more])
    true = seen(case.machine, plan, motion, effects)
    shown = {s.output: _shown(s, true[s.output], noise) for s in case.machine.sensors}
    exact, outputs = ({name: each[name] for name in case.logged} for each in (true, shown))
    t = np.tile(plan.period * np.arange(plan.samples, dtype=np.float64)[:, None], plan.runs)
    return Experiments(plan, t, motion.u, outputs, exact, effects)


def seen(machine: Machine, plan: Plan, motion: Motion, effects: Placed) -> dict[str, Array]:
    """Return what sensors with `effects` show of a motion, (samples, n) by output, without noise."""
    shown = {}
    for sensor in machine.sensors:
        y = (motion.v if sensor.rate else motion.q)[:, sensor.row] + sensor.through * motion.u
        for channel, effect in effects:
            if channel == f"sensor:{sensor.output}" and isinstance(effect, SensorEffect):
                y = effect.seen(plan.period, y)
        shown[sensor.output] = y
    return shown


class Built(NamedTuple):
    """A machine with what acts on it; the effects are new objects, which remember one simulation."""

    machine: Machine  # with its built-in effects
    #: Port and planted force; smooth ones come before those that project velocities
    forces: list[tuple[str, PortEffect]]
    drive: list[ActuatorEffect]  # distortions of the command, in the order of the signal


def built(machine: Machine, effects: Placed) -> Built:
    """Return a machine with planted effects."""
    for _, effect in effects:
        machine = effect.refitted(machine)
    forces = [(channel, effect) for channel, effect in effects if isinstance(effect, PortEffect)]
    forces.sort(key=lambda force: isinstance(force[1], DryFriction))
    return Built(machine, forces, [effect for _, effect in effects if isinstance(effect, ActuatorEffect)])


def _moved(
    case: Case, plan: Plan, effects: Placed, commands: Array | None, rng: np.random.Generator
) -> Motion:
    machine = case.machine
    t = plan.period * np.arange(plan.samples, dtype=np.float64)
    start = machine.start(plan.runs, rng)
    reference = references(t, plan.runs, machine.range, rng) if commands is None else commands
    machine, forces, drive = built(machine, effects)
    return move(machine, plan, reference, start, forces, drive, None if commands is None else _open_loop)


def _open_loop(reference: Array, slope: Array, q: Array, v: Array, c: Conditions) -> Array:
    return reference


def _shown(sensor: Sensor, y: Array, rng: np.random.Generator) -> Array:
    shown = y + sensor.noise * rng.standard_normal(y.shape)
    if sensor.quantum > 0.0:
        shown = sensor.quantum * np.round(shown / sensor.quantum)
    return np.mod(shown, TURN) if sensor.wraps else shown
