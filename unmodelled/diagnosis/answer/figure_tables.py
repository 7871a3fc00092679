"""Tables of a diagnosis that its figures and its page are made of."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from unmodelled.base.arrays import Array
from unmodelled.base.files import write_json
from unmodelled.base.tables import write_table
from unmodelled.diagnosis.answer.column_units import (
    channels_in_columns,
    regions_in_columns,
    table_in_columns,
)
from unmodelled.diagnosis.answer.live_machine import about_machine
from unmodelled.diagnosis.data.gap import LARGEST_ERROR, steps_of
from unmodelled.diagnosis.data.result import Diagnosis, JudgedModel
from unmodelled.diagnosis.where.correction_tables import (
    PORT,
    about_channels,
    correction_table,
    law_table,
    main_coordinate,
    shown_channels,
)
from unmodelled.diagnosis.where.where import Where
from unmodelled.effects.added import Added
from unmodelled.logs.logs import as_logged
from unmodelled.systems.model import System

FOLDER, ABOUT = "tables", "about.json"
#: Intervals into which the time of an experiment is divided.
INTERVALS = 25


def write_tables(diagnosis: Diagnosis, where: Where, folder: Path) -> None:
    """Write the tables of figures and page into `folder`/tables.

    - windows: corrections that the physics without effects needs, and those that the augmented model still
      needs, see `correction_table`.
    - laws: the found laws along the coordinate that matters most, see `law_table`.
    - steps: kind, label, gap; from the known model, an effect at a time, to the augmented one, then the model
      with networks and the floor.
    - experiments: id, held_out, known, reidentified, augmented, floor: gaps.
    - trajectory: of the worst experiment, output, t, measured, known, augmented; nan where nothing
      was simulated.
    - candidates: label, named, difference, standard_error (see `Compared`).
    - correlations: row, column, correlation: of the fitted numbers, where there are two.
    - evidence: label, horizon, nats, removed (see `Evidence`), where laws were compared by evidence.
    - time: over (experiment: its time; window: time since its start), t, reidentified, augmented: root mean
      square errors in standard deviations of the outputs.
    - about.json: names, units and what is shown.

    Values of inputs and outputs, and of coordinates that a column shows, are in the units of the columns.
    """
    found = correction_table(diagnosis, where)
    worst, shown = _worst(diagnosis), shown_channels(diagnosis, where)
    system, channels = diagnosis.system, about_channels(where.lacking, shown)
    along = {name: main_coordinate(found, name) for name in channels}
    laws = law_table(diagnosis, where, found, shown)
    tables = {
        "windows": table_in_columns(system, channels, found),
        "laws": table_in_columns(system, channels, laws, along),
        "steps": _steps(diagnosis),
        "experiments": _experiments(diagnosis, where),
        "trajectory": _trajectory(diagnosis, worst),
        "candidates": _candidates(diagnosis),
        "time": pd.concat(_time(diagnosis), ignore_index=True),
    }
    if diagnosis.correlations:
        rows = [(*pair, value) for pair, value in diagnosis.correlations.items()]
        tables["correlations"] = pd.DataFrame(rows, columns=["row", "column", "correlation"])
    if diagnosis.evidence:
        tables["evidence"] = _evidence(diagnosis)
    for name, table in tables.items():
        write_table(table, folder / FOLDER / name)
    write_json(folder / FOLDER / ABOUT, _about(diagnosis, where, along, worst))


def _about(diagnosis: Diagnosis, where: Where, along: Mapping[str, str], worst: str) -> dict[str, Any]:
    noise, system = where.lacking.recording.noise, diagnosis.system
    channels = channels_in_columns(system, about_channels(where.lacking, list(along)))
    return {
        "system": system.name,
        "verdict": diagnosis.verdict,
        "horizon": diagnosis.horizon,
        "effects": [each.added.title for each in diagnosis.effects],
        "channels": channels,
        "shown": [[name, coordinate] for name, coordinate in along.items()],
        "regions": regions_in_columns(system, where.regions),
        "worst": worst,
        "data": str(diagnosis.logs.provenance.get("data", "")),
        "units": _units(system, channels),
        "machine": about_machine(system),
        "outputs": [
            {"name": output.name, "unit": output.column_unit, "error_unit": output.as_difference.text}
            | {"noise": float(sigma) / output.as_difference.factor}
            for output, sigma in zip(system.outputs, noise, strict=True)
        ],
    }


def _units(system: System, channels: Mapping[str, Any]) -> dict[str, str]:
    """By name, of parameters and of the signals that regions are told in."""
    found = {parameter.name: parameter.unit for parameter in system.parameters}
    found |= {item.name: item.column_unit for item in system.inputs}
    for entry in channels.values():
        axes = (entry[key] for key in PORT if key in entry)
        found |= {axis["name"]: axis["unit"] for axis in axes}
    return found


def _worst(diagnosis: Diagnosis) -> str:
    each = diagnosis.known.gap.per_experiment
    return max(each, key=lambda name: each[name])


def _steps(diagnosis: Diagnosis) -> pd.DataFrame:
    effects = sorted(diagnosis.effects, key=lambda found: found.step)
    after = diagnosis.steps[len(diagnosis.steps) - len(effects) :]
    rows = [
        ("known", "as given", diagnosis.known.gap.value),
        ("reidentified", "re-identified", diagnosis.reidentified.gap.value),
        *(
            ("effect", found.added.title, model.gap.value)
            for found, model in zip(effects, after, strict=True)
        ),
        ("neural", "network in every port", diagnosis.neural.gap.value),
        ("floor", "noise of the sensors", diagnosis.floor),
    ]
    return pd.DataFrame(rows, columns=["kind", "label", "gap"])


def _experiments(diagnosis: Diagnosis, where: Where) -> pd.DataFrame:
    held = np.isin(np.arange(len(diagnosis.logs)), diagnosis.held_out)
    return pd.DataFrame({"id": diagnosis.logs.ids, "held_out": held, **vars(where.every)})


def _trajectory(diagnosis: Diagnosis, worst: str) -> pd.DataFrame:
    logs = diagnosis.logs
    rows = logs.rows(logs.ids.index(worst))
    parts = [
        pd.DataFrame(
            {
                "output": output.name,
                "t": logs.t[rows],
                "measured": as_logged(output, logs.y[rows, j]),
                "known": as_logged(output, diagnosis.known.gap.run.y[rows, j]),
                "augmented": as_logged(output, diagnosis.augmented.gap.run.y[rows, j]),
            }
        )
        for j, output in enumerate(diagnosis.system.outputs)
    ]
    return pd.concat(parts, ignore_index=True)


def _candidates(diagnosis: Diagnosis) -> pd.DataFrame:
    rows = [(_label(c.effects), c.named, c.difference, c.standard_error) for c in diagnosis.comparison]
    return pd.DataFrame(rows, columns=["label", "named", "difference", "standard_error"])


def _evidence(diagnosis: Diagnosis) -> pd.DataFrame:
    rows = [(one.added.title, one.horizon, one.nats, one.removed) for one in diagnosis.evidence]
    columns = ["label", "horizon", "nats", "removed"]
    return pd.DataFrame(rows, columns=columns).replace(-np.inf, np.nan)


def _label(effects: tuple[Added, ...]) -> str:
    return " + ".join(effect.title for effect in effects) or "no effect"


def _time(diagnosis: Diagnosis) -> Iterator[pd.DataFrame]:
    """Errors over the time of an experiment, and over the time since the start of a window."""
    logs, steps = diagnosis.logs, steps_of(diagnosis.horizon, diagnosis.logs)
    rows = np.concatenate([np.arange(logs.offsets[i], logs.offsets[i + 1]) for i in diagnosis.held_out])
    number = rows - logs.offsets[logs.owner[rows]]
    longest = float(number.max() + 1)
    stretch = np.minimum(number * INTERVALS // longest, INTERVALS - 1).astype(np.int64)
    models = {"reidentified": diagnosis.reidentified, "augmented": diagnosis.augmented}
    square = {name: _square(model)[rows] for name, model in models.items()}
    age = np.where(number > 0, (number - 1) % steps + 1, 0)
    for over, part in {"experiment": stretch, "window": age}.items():
        t = logs.t[rows] if over == "experiment" else age * logs.period
        table = pd.DataFrame({"part": part, "t": t, **square}).dropna()
        means = table.groupby("part").mean()
        yield means.assign(over=over, **{name: np.sqrt(means[name]) for name in models})


def _square(model: JudgedModel) -> Array:
    """(samples,) mean over the outputs of the square errors; nan where nothing was simulated."""
    run, logs = model.gap.run, model.logs
    error = (run.y - logs.y) / np.array([model.gap.scale[name] for name in logs.outputs])
    cut = np.where(np.abs(error) <= LARGEST_ERROR, error, LARGEST_ERROR) ** 2
    counted = np.where(run.counted, cut, 0.0).sum(axis=1)
    with np.errstate(invalid="ignore"):
        return np.asarray(counted / run.counted.sum(axis=1))
