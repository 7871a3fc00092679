"""A system and measured experiments as data for a page, which simulates them itself."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

import numpy as np
import sympy as sp

from unmodelled.base.arrays import Array
from unmodelled.diagnosis.answer.live_numbers import parameter_sliders, values_of
from unmodelled.diagnosis.data.gap import Gap, steps_of
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.data.sensors import Sensors
from unmodelled.diagnosis.fitting.simulation import Simulation
from unmodelled.engine.machine.javascript import as_data, as_text
from unmodelled.engine.machine.program import Program
from unmodelled.logs.logs import Logs
from unmodelled.logs.observer import Observer
from unmodelled.logs.readings import hidden_states, readings
from unmodelled.systems.model import TIME, Output, System

#: Numbers of all experiments that a page holds, of 11 bytes each: a page stays below about 4 MB.
MOST_NUMBERS = 250_000
#: Samples of an experiment that a page simulates: a change of a slider shows within a fraction of a second.
MOST_SAMPLES = 20_000
#: Samples with which a part of an experiment is worth showing.
FEWEST_SAMPLES = 200


def simulated(system: System, logs: Logs, runs: Sequence[int], horizon: float, gap: Gap) -> dict[str, Any]:
    """Return the data of a system as it is given, with sliders, and of the experiments `runs` (runs,)."""
    values = values_of(list(system.values), system, logs)
    order = sorted(runs, key=lambda i: -gap.per_experiment[logs.ids[i]])
    return {
        **machine(system, logs, [output.expression for output in system.outputs], horizon),
        "derived": None,
        "substeps": gap.substeps,
        "given": values,
        "identified": values,
        "numbers": parameter_sliders(system),
        "effects": [],
        "experiments": experiments(system, logs, order, [(c, c) for c in logs.c]),
    }


def about_machine(system: System) -> dict[str, Any]:
    """Return what a drawing of the machine shows: names and units of inputs, states, ports and outputs."""
    named = {
        "inputs": [{"name": item.name, "unit": item.column_unit} for item in system.inputs],
        "states": [{"name": item.name, "unit": item.unit} for item in system.states],
        "outputs": [{"name": item.name, "unit": item.column_unit} for item in system.outputs],
    }
    ports = [{"name": port.name, "effort": port.effort, "unit": port.unit} for port in system.ports]
    return {**named, "ports": ports}


def machine(system: System, logs: Logs, observed: Sequence[sp.Expr], horizon: float) -> dict[str, Any]:
    """Return what the page needs to simulate a system; arrays are text, see `as_text`."""
    return {
        "program": as_data(Program.of(system, observed)),
        **_start(system),
        "period": logs.period,
        "steps": steps_of(horizon, logs),
        "hold": [item.course for item in system.inputs],
        "inputs": [{"name": item.name, "unit": item.column_unit} for item in system.inputs],
        "outputs": [_shown(item) for item in system.outputs],
    }


def _shown(item: Output) -> dict[str, Any]:
    """Output with the unit in which the page shows it; the machine itself runs in SI units."""
    unit = item.as_written
    found = {"name": item.name, "unit": unit.text}
    if item.logged is None:
        return found
    return {**found, "error_unit": item.as_difference.text, "factor": unit.factor, "offset": unit.offset}


def _start(system: System) -> dict[str, Any]:
    """What gives the states at the start of a window: readings of outputs, and an observer of the others."""
    found = readings(system)
    expressions = [e for r in found for e in (r.gain, r.offset, r.lag)]
    hidden = hidden_states(system, found)
    observer = Observer.of(system, found) if hidden else None
    beside = [r.beside for r in found]
    moving = {TIME, *system.u} & set[object]().union(*(e.free_symbols for e in expressions))
    return {
        "readings": [{"state": r.state, "output": r.output, "slope": r.slope} for r in found],
        "gains": None if all(r.plain for r in found) else as_data(Program.of(system, expressions)),
        "steady": not moving,
        "beside": as_data(Program.of(system, beside)) if any(beside) else None,
        "hidden": hidden,
        "observer": observer
        and {
            "program": as_data(observer.program),
            "initial": as_data(observer.initial),
            "columns": list(observer.columns),
            "hold": list(observer.hold),
        },
    }


def experiments(
    system: System,
    logs: Logs,
    order: Sequence[int],
    constants: Sequence[tuple[Array, Array]],
    held_out: Collection[int] = (),
) -> list[dict[str, Any]]:
    """Return measured experiments, as many as a page can hold; each of `constants` has shape (constants,)."""
    sensors = Sensors(logs)
    with_slope = sorted({r.output for r in readings(system) if r.slope or r.lag != 0})
    width = logs.u.shape[1] + logs.y.shape[1] + len(with_slope)
    found, room = [], MOST_NUMBERS // width
    hidden = _continued(system, logs, np.array([identified for _, identified in constants]))
    for i in order:
        first, last = (int(k) for k in logs.offsets[i : i + 2])
        samples = min(last - first, MOST_SAMPLES, room)
        if samples < min(last - first, FEWEST_SAMPLES):
            break
        rows, room = np.arange(first, first + samples), room - samples
        found.append(
            {
                "id": logs.ids[i],
                "held_out": i in held_out,
                "logged": last - first,
                "u": [as_text(column) for column in logs.u[rows].T],
                "y": [as_text(column) for column in logs.y[rows].T],
                "v": {str(j): as_text(sensors.slope(j, 0.0, rows)) for j in with_slope},
                "given": as_text(constants[i][0]),
                "identified": as_text(constants[i][1]),
                "hidden": hidden.get(i),
            }
        )
    return found


def _continued(system: System, logs: Logs, c: Array) -> dict[int, str]:
    """States that no output shows at the starts of the experiments that continue another one, by number."""
    runs = [i for i in range(len(logs)) if logs.gap(i) is not None]
    if not runs or not hidden_states(system, readings(system)):
        return {}
    simulation = Simulation(system, Recording.whole(logs, runs), c=c)
    starts = simulation.hidden_starts(simulation.values[None, None])[:, 0]
    return dict(zip(simulation.recording.owner.tolist(), map(as_text, starts), strict=True))
