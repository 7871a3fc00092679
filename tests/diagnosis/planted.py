"""Small machines in which any effect of the library can be planted, and their logs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from tests.diagnosis.benches import pendulum
from tests.machines.folders import write_runs
from unmodelled.effects.added import Added, with_numbers
from unmodelled.effects.columns import in_columns
from unmodelled.effects.effect import Effect
from unmodelled.effects.library import effects
from unmodelled.effects.scales import Scales
from unmodelled.logs.folder import read_logs
from unmodelled.systems.model import Constant, System
from unmodelled.systems.numeric import numpy_system_function

Array = NDArray[np.float64]

PERIOD, RUNS, SAMPLES, SUBSTEPS = 0.005, 4, 240, 4
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
TEXT = """
schema: system/1
name: pendulum
states: {theta: {unit: rad}, omega: {unit: rad/s}}
inputs: {torque: {unit: N m}}
outputs: {theta: {unit: rad}, omega: {unit: rad/s}}
parameters:
  b: {value: 0.03, unit: N m s/rad}
  J: {value: 0.02, unit: kg m^2}
  mgl: {value: 0.4, unit: N m, identify: true, bounds: [0.1, 2]}
ports: {joint: {effort: tau, unit: N m, position: theta, velocity: omega}}
dynamics: {theta: omega, omega: (torque - b*omega - mgl*sin(theta) - tau)/J}
"""
#: A balance; nothing of it is measured but its level.
VESSEL = """
schema: system/1
name: vessel
states: {h: {unit: m}}
inputs: {flow: {unit: m^3/s}}
outputs: {h: {unit: m}}
parameters:
  k: {value: 1.0, unit: m^2/s}
  q_in: {value: 1.5, unit: m^3/s}
  A: {value: 0.3, unit: m^2, identify: true, bounds: [0.1, 1]}
ports: {bottom: {effort: q, unit: m^3/s, position: h}}
dynamics: {h: (q_in + flow - k*h - q)/A}
"""
ROOM = """
schema: system/1
name: room
states: {T: {unit: K}}
inputs: {P: {unit: W}}
outputs: {T: {unit: K}}
parameters:
  k: {value: 1.0, unit: W/K}
  P_0: {value: 1.5, unit: W}
  C: {value: 0.3, unit: W s/K, identify: true, bounds: [0.1, 1]}
ports: {air: {effort: q, unit: W, position: T}}
dynamics: {T: (P_0 + P - k*T - q)/C}
"""
#: Its equations use neither the fan nor the temperature outdoors.
BED = ROOM.replace("inputs: {P: {unit: W}}", "inputs: {P: {unit: W}, fan: {unit: '1'}, T_out: {unit: K}}")
COIL = """
schema: system/1
name: coil
states: {i: {unit: A}}
inputs: {u: {unit: V}}
outputs: {i: {unit: A}}
parameters:
  R: {value: 1.0, unit: ohm}
  L: {value: 0.3, unit: H, identify: true, bounds: [0.1, 1]}
ports: {winding: {effort: e, unit: V, velocity: i}}
dynamics: {i: (u - R*i - e)/L}
"""
#: Its voltage follows the current at once.
CELL = """
schema: system/1
name: cell
states: {q: {unit: A s}}
inputs: {i: {unit: A}}
outputs: {v: {unit: V, expression: 3.6 - q/C - R*i}}
parameters:
  C: {value: 2.0, unit: A s/V}
  R: {value: 0.5, unit: ohm, identify: true, bounds: [0.1, 1]}
ports: {charge: {effort: i_x, unit: A, position: q}}
dynamics: {q: i - i_x}
"""
#: Two bodies with a spring between them, soft enough for the slow motion of the runs.
COUPLING = (
    Path("systems/coupling.yaml").read_text().replace("value: 40", "value: 4").replace("[10, 100]", "[1, 10]")
)


def with_companions(effect: Effect) -> tuple[Effect, ...]:
    """The effect, after the simplest law that it needs beside it, if any."""
    companions = [e for e in effects() if e.family in effect.beside]
    return (*companions[:1], effect)


def plant(
    folder: Path, effect: Effect, ids: Sequence[str] | None = None, numbers: Mapping[str, float] | None = None
) -> None:
    """Write `folder`/logs of the machine with the effect, and `folder`/system.yaml without it.

    Args:
        folder: folder that is made.
        effect: effect to plant.
        ids: ids of the experiments; default: run0, run1 and so on.
        numbers: values of some numbers of the law; default: a size that can be seen of every number.
    """
    ids = ids or (GROUPED if effect.at_levels else IDS)
    groups = [GROUPS[k % len(GROUPS)] for k in range(len(ids))]
    machines = (pendulum(folder, text=text) for text in (TEXT, VESSEL, ROOM, COIL, CELL, COUPLING, BED))
    known = next(machine for machine in machines if effect.places(machine))
    rates = OTHER_RATES.get(effect.family, RATES)
    _write(folder / "logs", known, {}, ids, rates)
    logs = read_logs(folder / "logs", known)
    sizes = Scales.measured(known, logs.period, logs.offsets, logs.t, logs.x, logs.u, logs.c)
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
    held = true.inputs[0].delay / PERIOD
    # (samples, runs, inputs)
    acting = _at(np.arange(SAMPLES) - held, u)
    x = _path(true, acting, c)
    show = numpy_system_function(true, [o.expression for o in true.outputs], efforts_zero=True)
    y = np.stack(
        [
            show(s, state, v, np.empty(0), np.array(true.values), c)
            for s, state, v in zip(t, x, acting, strict=True)
        ]
    )
    tables = []
    for k in range(runs):
        shown = {
            o.name: np.interp(t - o.delay, t, y[:, k, j]) + NOISE[j] * rng.standard_normal(SAMPLES)
            for j, o in enumerate(true.outputs)
        }
        given = {item.name: u[:, k, j] for j, item in enumerate(true.inputs)}
        tables.append({"t": t, **shown, **given})
    write_runs(folder, tables, id=ids)


def _at(samples: Array, u: Array) -> Array:
    """Inputs (samples, runs, inputs) at other instants, in samples; straight lines between them."""
    known = np.arange(len(u))
    columns = [np.interp(samples, known, column) for column in u.reshape(len(u), -1).T]
    return np.stack(columns, axis=1).reshape(len(samples), *u.shape[1:])


def _path(system: System, u: Array, c: Array) -> Array:
    """(samples, runs, states) by Runge and Kutta's method, inputs straight between samples."""
    rates = numpy_system_function(system, list(system.closed), efforts_zero=True)
    p, h = np.array(system.values), 1.0 / SUBSTEPS
    # in samples, where the inputs are straight from one to the next
    fine = np.arange((SAMPLES - 1) * 2 * SUBSTEPS + 1) / (2 * SUBSTEPS)
    torque = _at(fine, u)

    def slope(k: int, x: Array) -> Array:
        return PERIOD * np.asarray(rates(PERIOD * fine[k], x, torque[k], np.empty(0), p, c))

    initial = numpy_system_function(system, [state.initial for state in system.states], efforts_zero=True)
    x = np.zeros((u.shape[1], len(system.states)))
    for _ in range(2):  # what the library adds may start at the states of the machine
        x = np.asarray(initial(0.0, x, torque[0], np.empty(0), p, c))
    path = [x]
    for k in range(0, len(fine) - 1, 2):
        k1 = slope(k, x)
        k2 = slope(k + 1, x + 0.5 * h * k1)
        k3 = slope(k + 1, x + 0.5 * h * k2)
        x = x + h / 6.0 * (k1 + 2.0 * (k2 + k3) + slope(k + 2, x + h * k3))
        path.append(x)
    return np.array(path[::SUBSTEPS])
