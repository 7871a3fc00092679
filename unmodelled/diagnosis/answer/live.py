"""The augmented system and the measured experiments as data for the page, which simulates them itself."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from unmodelled.base.files import read_json, replacing
from unmodelled.diagnosis.answer.figure_tables import ABOUT, FOLDER, readable
from unmodelled.diagnosis.answer.live_numbers import about_effects, given_values, sliders
from unmodelled.diagnosis.data.gap import steps_of
from unmodelled.diagnosis.data.result import DiagnosedEffect, Diagnosis
from unmodelled.diagnosis.data.sensors import Sensors
from unmodelled.diagnosis.where.effect_channels import channel_of
from unmodelled.engine.machine.javascript import as_data, as_text
from unmodelled.engine.machine.program import Program
from unmodelled.logs.observer import Observer
from unmodelled.logs.readings import hidden_states, readings
from unmodelled.systems.model import TIME, System, symbol

Array = NDArray[np.float64]

LIVE = "live.json"
#: Numbers of all experiments that the page holds, of 11 bytes each: a page stays below about 4 MB.
MOST_NUMBERS = 250_000
#: Samples of an experiment that the page simulates: a change of a slider shows within a fraction of a second.
MOST_SAMPLES = 20_000
#: Samples with which a part of an experiment is worth showing.
FEWEST_SAMPLES = 200


def write_live(diagnosis: Diagnosis, folder: Path) -> None:
    """Write tables/live.json: the augmented system as a program of the register machine, and experiments.

    Args:
        diagnosis: diagnosis with a fitted model.
        folder: folder of the answer, with the tables that `write_tables` wrote.

    Raises:
        BadInput: when a table is missing, or the file cannot be written.
    """
    shown = dict(read_json(folder / FOLDER / ABOUT)["shown"])
    with replacing(folder / FOLDER / LIVE) as temporary:
        temporary.write_text(json.dumps(live(diagnosis, shown), separators=(",", ":"), allow_nan=False))


def live(diagnosis: Diagnosis, shown: Mapping[str, str]) -> dict[str, Any]:
    """Return the content of tables/live.json; arrays are text, see `as_text`.

    Args:
        diagnosis: diagnosis with a fitted model.
        shown: coordinate (level, rate or another) along which a law is shown, by channel.

    Returns:
        Programs of the augmented system, numbers with intervals, effects with what switches them off, and
        measured experiments.
    """
    model = diagnosis.augmented
    system, logs = model.system, model.logs
    curves = [_curve(diagnosis, found, shown) for found in diagnosis.effects]
    observed = [output.expression for output in system.outputs]
    observed += [e for curve in curves if curve is not None for e in curve[1]]
    labels = [None if curve is None else curve[0] for curve in curves]
    return {
        "program": as_data(Program.of(system, observed)),
        **_start(system),
        **_derived(diagnosis),
        "period": logs.period,
        "steps": steps_of(diagnosis.horizon, logs),
        "substeps": max(diagnosis.known.gap.substeps, model.gap.substeps),
        "hold": [item.course for item in system.inputs],
        "inputs": [{"name": item.name, "unit": item.unit} for item in system.inputs],
        "outputs": [{"name": item.name, "unit": item.unit} for item in system.outputs],
        "given": given_values(diagnosis, diagnosis.system),
        "identified": given_values(diagnosis, system),
        "numbers": sliders(diagnosis),
        "effects": [
            {"name": readable(found.added), "curve": label, **about}
            for found, label, about in zip(diagnosis.effects, labels, about_effects(diagnosis), strict=True)
        ],
        "experiments": _experiments(diagnosis),
    }


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


def _derived(diagnosis: Diagnosis) -> dict[str, Any]:
    """Parameters that follow from the others: slopes of laws beyond the data."""
    system = diagnosis.augmented.system
    names = [p.name for p in system.parameters]
    slopes = {name: e for found in diagnosis.effects for name, e in found.added.slopes.items()}
    program = Program.of(system, [sp.Max(e, 0) for e in slopes.values()]) if slopes else None
    return {"derived": program and {"at": [names.index(n) for n in slopes], "program": as_data(program)}}


def _curve(
    diagnosis: Diagnosis, found: DiagnosedEffect, shown: Mapping[str, str]
) -> tuple[dict[str, Any], list[sp.Expr]] | None:
    """Names and expressions of an effect's law and the coordinate along which it is shown."""
    system, added = diagnosis.augmented.system, found.added
    place = added.place
    if not added.regressors or place.kind == "parameter":
        return None
    law = sum(
        (symbol(n) * f for n, f in zip(added.amplitudes, added.regressors, strict=True)), start=sp.S.Zero
    )
    if place.kind == "port":
        port = system.port(place.name)
        axes = {"level": port.position, "rate": port.velocity}
        own = [n for n in axes.values() if n and law.free_symbols & system.expression(n).free_symbols]
        wanted = axes.get(shown.get(channel_of(diagnosis.reidentified, place), "rate"))
        axis = own[0] if len(own) == 1 else wanted or port.velocity or port.position
        x = TIME if axis is None else system.expression(axis)
        label = {"x": axis or "t", "y": port.effort, "unit": port.unit}
    elif place.kind == "actuator":
        item = next(item for item in system.inputs if item.name == place.name)
        x, label = symbol(item.name), {"x": item.name, "y": f"change of {item.name}", "unit": item.unit}
    else:
        output = next(item for item in system.outputs if item.name == place.name)
        before = next(item for item in diagnosis.system.outputs if item.name == place.name)
        x, label = before.expression, {"x": before.name, "y": f"error of {output.name}", "unit": output.unit}
    return label, [x, law]


def _experiments(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """Held-out experiments first, as many as a page can hold."""
    given, model = diagnosis.logs, diagnosis.augmented
    sensors = Sensors(given)
    with_slope = sorted({r.output for r in readings(model.system) if r.slope or r.lag != 0})
    width = given.u.shape[1] + given.y.shape[1] + len(with_slope)
    order = [*diagnosis.held_out, *(i for i in range(len(given)) if i not in diagnosis.held_out)]
    found, room = [], MOST_NUMBERS // width
    for i in order:
        first, last = (int(k) for k in given.offsets[i : i + 2])
        samples = min(last - first, MOST_SAMPLES, room)
        if samples < min(last - first, FEWEST_SAMPLES):
            break
        rows, room = np.arange(first, first + samples), room - samples
        found.append(
            {
                "id": given.ids[i],
                "held_out": i in diagnosis.held_out,
                "logged": last - first,
                "u": [as_text(column) for column in given.u[rows].T],
                "y": [as_text(column) for column in given.y[rows].T],
                "v": {str(j): as_text(sensors.slope(j, 0.0, rows)) for j in with_slope},
                "given": as_text(_constants(diagnosis, i)),
                "identified": as_text(model.logs.c[i]),
            }
        )
    return found


def _constants(diagnosis: Diagnosis, i: int) -> Array:
    """Constants of an experiment in the system as given: effects that differ between experiments are off."""
    given, c = diagnosis.logs, diagnosis.augmented.logs.c[i].copy()
    known = dict(zip(given.constants, given.c[i], strict=True))
    known |= {p.name: p.value for p in diagnosis.system.parameters}
    known |= {n: 0.0 for found in diagnosis.effects for n in found.added.amplitudes}
    for k, name in enumerate(diagnosis.augmented.logs.constants):
        c[k] = known.get(name, c[k])
    return np.asarray(c)
