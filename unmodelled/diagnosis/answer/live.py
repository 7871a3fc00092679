"""The augmented system and the measured experiments as data for the page, which simulates them itself."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pandas as pd
import sympy as sp

from unmodelled.base.arrays import Array
from unmodelled.base.files import read_json, replacing
from unmodelled.base.tables import read_table
from unmodelled.diagnosis.answer.column_units import axis_unit
from unmodelled.diagnosis.answer.figure_tables import ABOUT, FOLDER
from unmodelled.diagnosis.answer.live_machine import experiments, machine
from unmodelled.diagnosis.answer.live_numbers import about_effects, given_values, sliders
from unmodelled.diagnosis.data.result import DiagnosedEffect, Diagnosis
from unmodelled.diagnosis.where.effect_channels import channel_of
from unmodelled.engine.machine.javascript import as_data
from unmodelled.engine.machine.program import Program
from unmodelled.systems.model import TIME, symbol
from unmodelled.systems.units import LoggedUnit

LIVE = "live.json"


def write_live(diagnosis: Diagnosis, folder: Path) -> None:
    """Write tables/live.json: the augmented system as a program of the register machine, and experiments."""
    shown = dict(read_json(folder / FOLDER / ABOUT)["shown"])
    content = live(diagnosis, shown)
    windows = read_table(folder / FOLDER / "windows", ("channel", "experiment", "stage"))
    for effect, found in zip(content["effects"], diagnosis.effects, strict=True):
        effect["missing"] = _missing(diagnosis, windows, found) if effect["curve"] else None
    with replacing(folder / FOLDER / LIVE) as temporary:
        temporary.write_text(json.dumps(content, separators=(",", ":"), allow_nan=False))


def _missing(diagnosis: Diagnosis, windows: pd.DataFrame, found: DiagnosedEffect) -> dict[str, Any]:
    """Missing effort at the channel of an effect by experiment: samples, and means around them."""
    logs, channel = diagnosis.augmented.logs, channel_of(diagnosis.reidentified, found.added.place)
    rows = windows[(windows["channel"] == channel) & (windows["stage"] == "lacking")].dropna(subset="value")
    first = dict(zip(logs.ids, logs.t[logs.offsets[:-1]].tolist(), strict=True))
    return {
        name: {
            "at": np.rint((mine["t"] - first[name]) / logs.period).astype(int).tolist(),
            "value": [float(f"{value:.4g}") for value in mine["value"]],
        }
        for name, mine in rows.groupby("experiment")
    }


def live(diagnosis: Diagnosis, shown: Mapping[str, str]) -> dict[str, Any]:
    """Return the content of tables/live.json; arrays are text, see `as_text`."""
    model = diagnosis.augmented
    system, logs = model.system, model.logs
    curves = [_curve(diagnosis, found, shown) for found in diagnosis.effects]
    observed = [output.expression for output in system.outputs]
    observed += [e for curve in curves if curve is not None for e in curve[1]]
    labels = [None if curve is None else curve[0] for curve in curves]
    held_out = diagnosis.held_out
    order = [*held_out, *(i for i in range(len(logs)) if i not in held_out)]
    marked = held_out if len(held_out) < len(logs) else ()  # where each is left out once, none is special
    constants = [(_constants(diagnosis, i), logs.c[i]) for i in range(len(logs))]
    return {
        **machine(system, diagnosis.logs, observed, diagnosis.horizon),
        **_derived(diagnosis),
        "substeps": max(diagnosis.known.gap.substeps, model.gap.substeps),
        "given": given_values(diagnosis, diagnosis.system),
        "identified": given_values(diagnosis, system),
        "numbers": sliders(diagnosis),
        "effects": [
            {"name": found.added.title, "curve": label, **about}
            for found, label, about in zip(diagnosis.effects, labels, about_effects(diagnosis), strict=True)
        ],
        "experiments": experiments(system, diagnosis.logs, order, constants, marked),
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
        label |= _scale("x", axis_unit(diagnosis.system, axis or "t"))
    elif place.kind == "actuator":
        item = next(item for item in system.inputs if item.name == place.name)
        x, label = symbol(item.name), {"x": item.name, "y": f"change of {item.name}", "unit": item.unit}
        label |= _scale("x", item.as_written) | _scale("y", item.as_difference)
    else:
        output = next(item for item in system.outputs if item.name == place.name)
        before = next(item for item in diagnosis.system.outputs if item.name == place.name)
        x, label = before.expression, {"x": before.name, "y": f"error of {output.name}", "unit": output.unit}
        label |= _scale("x", output.as_written) | _scale("y", output.as_difference)
    return label, [x, law]


def _scale(axis: Literal["x", "y"], unit: LoggedUnit | None) -> dict[str, Any]:
    """Unit of an axis, with its factor and its zero in SI; nothing for an axis that is shown in SI."""
    if unit is None or (unit.factor, unit.offset) == (1.0, 0.0):
        return {}
    return {{"x": "x_unit", "y": "unit"}[axis]: unit.text, f"{axis}_scale": [unit.factor, unit.offset]}


def _constants(diagnosis: Diagnosis, i: int) -> Array:
    """Constants of an experiment in the system as given: effects that differ between experiments are off."""
    given, c = diagnosis.logs, diagnosis.augmented.logs.c[i].copy()
    known = dict(zip(given.constants, given.c[i], strict=True))
    known |= {p.name: p.value for p in diagnosis.system.parameters}
    known |= {n: 0.0 for found in diagnosis.effects for n in found.added.amplitudes}
    for k, name in enumerate(diagnosis.augmented.logs.constants):
        c[k] = known.get(name, c[k])
    return np.asarray(c)
