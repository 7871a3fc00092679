"""Small machines in which any effect of the library can be planted, and their logs."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from tests.diagnosis.studies import scales_of
from tests.machines.folders import Array, changed, motion, system_of, text_of, write_runs
from unmodelled.effects.added import Added, with_numbers
from unmodelled.effects.columns import in_columns
from unmodelled.effects.effect import Effect
from unmodelled.effects.library import effects
from unmodelled.effects.scales import Scales
from unmodelled.logs.folder import read_logs
from unmodelled.systems.model import Constant, System
from unmodelled.systems.numeric import numpy_system_function

PERIOD, RUNS, SAMPLES = 0.005, 4, 240
#: SI, the effort that is planted at the port; the noise of angle and speed, or of the level.
EFFORT, NOISE = 0.15, (2e-5, 2e-4)
#: rad/s, of the torque in the first and the last run. A stop must be reached in several runs: what one run
#: alone shows is not confirmed by the others. A spring twists where the motion is as fast as its resonance.
RATES, OTHER_RATES = (3.0, 8.0), {"end_stop": (5.0, 7.0), "flexible_transmission": (12.0, 25.0)}
#: Of each run, a number of its own, in its plausible size; in no order, or it would be a drift.
OWN = (1.2, -3.0, 4.5, -1.5)
IDS = tuple(f"run{k}" for k in range(RUNS))
#: Groups that take turns; what acts at a level only is planted in the last one, and needs more runs.
GROUPS, GROUPED = ("old", "new"), tuple(f"run{k}" for k in range(2 * RUNS))
#: Two bodies with a spring between them, soft enough for the slow motion of the runs.
SOFT = ("value: 40", "value: 4"), ("[10, 100]", "[1, 10]")
#: A bed, whose equations use neither the fan nor the temperature outdoors.
IDLE = ("inputs: {P: {unit: W}}", "inputs: {P: {unit: W}, fan: {unit: '1'}, T_out: {unit: K}}")
#: Of a vessel, only its level is measured; the voltage of a cell follows the current at once.
MACHINES = (
    *(text_of(f"{name}.yaml") for name in ("planted_pendulum", "vessel", "room", "coil", "cell")),
    changed(Path("systems/coupling.yaml").read_text(), *SOFT),
    text_of("room.yaml", IDLE),
)


def with_companions(effect: Effect) -> tuple[Effect, ...]:
    """The effect, after the simplest law that it needs beside it, if any."""
    companions = [e for e in effects() if e.family in effect.beside]
    return (*companions[:1], effect)


def added_somewhere(folder: Path) -> Iterator[tuple[Effect, Added]]:
    """Yield every effect of the library as it stands in the first machine that has a place for it."""
    machines = list[tuple[System, Scales]]()
    for k, text in enumerate(MACHINES):
        known = system_of(text, folder / str(k))
        _write(folder / str(k) / "logs", known, {}, IDS, RATES)
        machines.append((known, scales_of(known, read_logs(folder / str(k) / "logs", known))))
    for effect in effects():
        system, sizes = next(each for each in machines if effect.places(each[0]))
        place = effect.places(system)[0]
        if effect.at_levels:
            place = replace(place, factor="group", level=GROUPS[-1])
        for each in with_companions(effect):
            added = each.add(system, place, sizes)
            system = added.system
        yield effect, added


def plant(
    folder: Path, effect: Effect, ids: Sequence[str] | None = None, numbers: Mapping[str, float] | None = None
) -> None:
    """Write `folder`/logs of the machine with the effect, and `folder`/system.yaml without it.

    `numbers` of the law that are not given have a size that can be seen.
    """
    ids = ids or (GROUPED if effect.at_levels else IDS)
    groups = [GROUPS[k % len(GROUPS)] for k in range(len(ids))]
    machines = (system_of(text, folder) for text in MACHINES)
    known = next(machine for machine in machines if effect.places(machine))
    rates = OTHER_RATES.get(effect.family, RATES)
    _write(folder / "logs", known, {}, ids, rates)
    logs = read_logs(folder / "logs", known)
    sizes = scales_of(known, logs)
    place = effect.places(known)[0]
    if effect.at_levels:
        place = replace(place, factor="group", level=GROUPS[-1])
        logs = replace(logs, experiments=logs.experiments.assign(group=groups))
    sizes = replace(sizes, effort={known.ports[0].name: EFFORT})
    planted, system = list[Added](), known
    for each in with_companions(effect):
        planted.append(each.add(system, place, sizes))
        system = planted[-1].system
    added, values = planted[-1], {name: value for one in planted for name, value in _numbers(one).items()}
    # beside another law, numbers of single experiments must be worth their complexity
    size = 1.5 if effect.beside else 1.0
    own = {name: size * added.scales[name] * np.array(OWN) for name in added.per_experiment}
    columns = {name: column(logs.experiments) for name, column in added.columns.items()}
    numbered = with_numbers(system, planted, values | dict(numbers or {}))
    grown = in_columns(numbered, [Constant(p.name, p.unit) for p in numbered.parameters if p.name in own])
    _write(folder / "logs", grown, {**columns, **own}, ids, rates)
    if effect.at_levels:
        table = folder / "logs" / "experiments.csv"
        pd.read_csv(table).assign(group=groups).to_csv(table, index=False)


def _numbers(added: Added) -> dict[str, float]:
    """A size that can be seen of every number."""
    amounts = {n: 1.0 if n in added.shares else added.scales[n] for n in added.amplitudes}
    return amounts | {n: grid[len(grid) // 2] for n, grid in added.shapes.items()}


def _write(
    folder: Path, true: System, own: dict[str, Array], ids: Sequence[str], rates: tuple[float, float]
) -> None:
    """Logs of `true`, whose constants are `own`."""
    rng, runs = np.random.default_rng(0), len(ids)
    t = PERIOD * np.arange(SAMPLES)
    rate, phase = np.linspace(*rates, runs), rng.uniform(0.0, 6.0, (2, runs))
    u = 0.9 * np.sin(rate * t[:, None] + phase[0]) + 0.5 * np.sin(2.3 * rate * t[:, None] + phase[1])
    # a further input moves more slowly
    others = [np.sin(0.6 * rate * t[:, None] + phase[1] + k) for k in range(1, len(true.inputs))]
    u = np.stack([u, *others], axis=-1)
    c = np.column_stack([own[constant.name] for constant in true.operating_point] or [np.empty((runs, 0))])
    known = np.arange(SAMPLES)
    late = known - true.inputs[0].delay / PERIOD
    acting = np.apply_along_axis(lambda column: np.interp(late, known, column), 0, u)
    x = _path(true, acting, c)  # (samples, runs, states)
    show = numpy_system_function(true, [o.expression for o in true.outputs], efforts_zero=True)
    p = np.array(true.values)
    y = np.stack([show(s, state, v, np.empty(0), p, c) for s, state, v in zip(t, x, acting, strict=True)])
    tables = []
    for k in range(runs):
        shown = {
            o.name: np.interp(t - o.delay, t, y[:, k, j]) + NOISE[j] * rng.standard_normal(SAMPLES)
            for j, o in enumerate(true.outputs)
        }
        given = {item.name: u[:, k, j] for j, item in enumerate(true.inputs)}
        tables.append({"t": t, **shown, **given})
    write_runs(folder, tables, id=ids)


def _path(system: System, u: Array, c: Array) -> Array:
    """States (samples, runs, states), inputs straight between samples."""
    rates = numpy_system_function(system, list(system.closed), efforts_zero=True)
    initial = numpy_system_function(system, [state.initial for state in system.states], efforts_zero=True)
    p, x = np.array(system.values), np.zeros((u.shape[1], len(system.states)))
    for _ in range(2):  # what the library adds may start at the states of the machine
        x = np.asarray(initial(0.0, x, u[0], np.empty(0), p, c))
    time = np.broadcast_to(PERIOD * np.arange(SAMPLES)[:, None, None], (*u.shape[:2], 1))
    acting = np.concatenate([u, time], axis=-1)
    law = lambda x, v: rates(v[0, -1], x, v[:, :-1], np.empty(0), p, c)  # noqa: E731
    return motion(law, x, acting, PERIOD)
