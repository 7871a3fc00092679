"""Numbers of the augmented system that a reader of the page can change, and what switches an effect off."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from unmodelled.diagnosis.data.result import DiagnosedEffect, Diagnosis, Estimate
from unmodelled.effects.added import Added
from unmodelled.effects.telling import scale
from unmodelled.engine.machine.javascript import as_text
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System

#: Share of the span of a slider that lies beyond the values that it must reach, on either side.
MARGIN = 0.25
#: Parameters of a system that get a slider where nothing was identified.
MOST_SLIDERS = 16

Place = dict[str, Any]


def given_values(diagnosis: Diagnosis, system: System) -> dict[str, Any]:
    """Return parameters and delays of a system in the order of the augmented one."""
    augmented = diagnosis.augmented.system
    off = {name: 0.0 for found in diagnosis.effects for name in found.added.amplitudes}
    own = {p.name: p.value for p in system.parameters}
    parameters = [own.get(p.name, off.get(p.name, p.value)) for p in augmented.parameters]
    return values_of(parameters, system, diagnosis.logs)


def values_of(parameters: Sequence[float], system: System, logs: Logs) -> dict[str, Any]:
    """Return parameters (parameters,) in SI, and the delays of a system, s."""
    logged = logs.delays or (0.0,) * len(system.inputs)
    return {
        "p": as_text(parameters),
        "inputs": [item.delay - late for item, late in zip(system.inputs, logged, strict=True)],
        "outputs": [item.delay for item in system.outputs],
    }


def about_effects(diagnosis: Diagnosis) -> Iterator[dict[str, Any]]:
    """Yield, for every effect, the places of the numbers that are zero where the effect is switched off."""
    for found in diagnosis.effects:
        names = (*found.added.amplitudes, *found.added.delays)
        yield {"off": [_place(diagnosis, found, name) for name in names]}


def sliders(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """Return every identified number with its 95 % interval and the range of its slider."""
    rows = []
    for k, found in enumerate(diagnosis.effects):
        off = (*found.added.amplitudes, *found.added.delays)  # without the effect they are zero
        for name, estimate in found.estimates.items():
            bounds = found.added.bounds.get(name)
            about = {"effect": k, "at": _place(diagnosis, found, name)}
            row = _slider(name, estimate, bounds, about, [0.0] * (name in off))
            rows.append({**row, **_as_said(found.added, name)})
        for name, values in found.own.items():
            each = np.array(list(values.values()))
            low, high = _range([*each, 0.0], found.added.bounds.get(name))
            about = {"effect": k, "at": _place(diagnosis, found, name), "interval": None, "known": None}
            row = {"name": name, "unit": found.added.units[name], "low": low, "high": high, **about}
            rows.append({**row, **_as_said(found.added, name)})
    parameters = {p.name: p for p in diagnosis.augmented.system.parameters}
    for name, estimate in diagnosis.parameters.items():
        about = {"effect": None, "at": _place(diagnosis, None, name)}
        rows.append(_slider(name, estimate, parameters[name].bounds, about, []))
    return [row for row in rows if row["low"] < row["high"]]


def _as_said(added: Added, name: str) -> dict[str, Any]:
    """How a person says the number of a slider, which itself stays in SI: symbol, unit, slope and shift."""
    if (found := scale(added, name)) is None:
        return {}
    symbol, unit, slope, shift = found
    return {"said": {"symbol": symbol.replace("*", "·"), "unit": unit, "slope": slope, "shift": shift}}


def parameter_sliders(system: System) -> list[dict[str, Any]]:
    """Return the parameters of a system that was not identified, those marked as uncertain first."""
    shared = [(k, p) for k, p in enumerate(system.parameters) if not p.per_experiment]
    chosen = sorted(shared, key=lambda one: not one[1].identify)[:MOST_SLIDERS]
    return [
        {"name": p.name, "unit": p.unit, "low": p.limits[0], "high": p.limits[1]}
        | {"effect": None, "at": {"kind": "p", "index": k}, "interval": None, "known": p.value}
        for k, p in chosen
        if np.isfinite(p.limits).all() and p.limits[0] < p.limits[1]
    ]


def _slider(
    name: str,
    estimate: Estimate,
    bounds: tuple[float, float] | None,
    about: dict[str, Any],
    reached: Sequence[float],
) -> dict[str, Any]:
    known = estimate.known if np.isfinite(estimate.known) else None
    ends = [float(end) for end in estimate.interval]
    interval = ends if np.isfinite(ends).all() else None
    values = [estimate.value, *(interval or ()), *([] if known is None else [known]), *reached]
    low, high = _range(values, bounds)
    return {"name": name, "unit": estimate.unit, "low": low, "high": high} | {
        "interval": interval,
        "known": known,
        **about,
    }


def _range(values: Sequence[float], bounds: tuple[float, float] | None) -> tuple[float, float]:
    """Range that reaches all values with some room, and a fifth of the largest; within the bounds."""
    low, high = float(min(values)), float(max(values))
    room = max(MARGIN * (high - low), 0.2 * max(abs(low), abs(high)))
    below, above = bounds or (-np.inf, np.inf)
    return max(low - room, min(below, low)), min(high + room, max(above, high))


def _place(diagnosis: Diagnosis, found: DiagnosedEffect | None, name: str) -> Place:
    """Where the page finds a number; a delay of an effect is part of the delay of its input or output."""
    model = diagnosis.augmented
    if found is not None and name in found.added.delays:
        place = found.added.delays[name]
        items = model.system.inputs if place.kind == "actuator" else model.system.outputs
        kind = "inputs" if place.kind == "actuator" else "outputs"
        index = [item.name for item in items].index(place.name)
        return {"kind": kind, "index": index, "value": found.estimates[name].value}
    parameters = [p.name for p in model.system.parameters]
    if name in parameters:
        return {"kind": "p", "index": parameters.index(name)}
    return {"kind": "c", "index": model.logs.constants.index(name)}
