"""diagnosis.json (`diagnosis/1`, shared/contracts/diagnosis.md) of a diagnosis."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from unmodelled.diagnosis.data.result import Candidate, DiagnosedEffect, Diagnosis, Estimate, LogFault
from unmodelled.diagnosis.where.effect_channels import channel_of
from unmodelled.diagnosis.where.where import Where
from unmodelled.effects.added import Added
from unmodelled.effects.place import Place

Ports = Mapping[Place, str]

SCHEMA = "diagnosis/1"
#: Significant digits of a number.
DIGITS = 8


def summary(diagnosis: Diagnosis, where: Where) -> dict[str, Any]:
    """Return the content of diagnosis.json: numbers, texts, lists and mappings; null for undefined numbers.

    Beside the entries of the contract it has: `variant` of an effect that has several; `parameter` of an
    effect
    on a parameter, whose port is where the parameter acts; `values` by experiment of a number that differs
    between experiments, whose `value` and `interval` are their mean and 95 % range; `signs` that the
    confidence
    is computed from; `partial` here and in each effect if they explain only part of the gap. The `evidence`
    of a candidate is its penalised log-likelihood relative to the best candidate, 0 or below. `logs` lists
    faults of the logs, a row per channel with a sentence, the faulty `experiments` (empty: all) and
    `indistinguishable`
    faults. With the verdict check_logs nothing was fitted: all gaps are those of the known model.

    Args:
        diagnosis: diagnosis.
        where: place of the gap.
    """
    partial: dict[str, Any] = {"partial": True} if diagnosis.partial else {}
    ports = _ports(diagnosis)
    content = {
        "schema": SCHEMA,
        "system": diagnosis.system.name,
        "seed": diagnosis.seed,
        "verdict": diagnosis.verdict,
        "confidence": diagnosis.confidence,
        "signs": diagnosis.signs,
        **partial,
        "effects": [_effect(found, ports) | partial for found in diagnosis.effects],
        "where": {
            name: list(getattr(where, name)) for name in ("channels", "regions", "factors", "experiments")
        },
        "gap": _gap(diagnosis),
        "parameters": {
            name: {"known": e.known, "identified": e.value, "unit": e.unit, "interval": e.interval}
            for name, e in diagnosis.parameters.items()
        },
        "candidates": [_candidate(candidate, ports) for candidate in diagnosis.candidates],
        "logs": [row for fault in diagnosis.faults for row in _fault(fault)],
        "notes": list(diagnosis.notes),
    }
    return {name: _plain(value) for name, value in content.items()}


def _ports(diagnosis: Diagnosis) -> dict[Place, str]:
    """Where effects act: that of a parameter at the port, input or sensor that the parameter belongs to."""
    added = [e for found in diagnosis.effects for e in (found.added, *found.indistinguishable)]
    places = {e.place for e in (*added, *(e for c in diagnosis.candidates for e in c.effects))}
    return {place: channel_of(diagnosis.reidentified, place) for place in places}


def _effect(found: DiagnosedEffect, ports: Ports) -> dict[str, Any]:
    numbers = {name: _estimate(estimate) for name, estimate in found.estimates.items()}
    own = {name: _own(found.added.units[name], values) for name, values in found.own.items()}
    return _named(found.added, ports) | {
        "law": found.added.law,
        "parameters": numbers | own,
        "confidence": found.confidence,
        "shrink": found.shrink,
        "indistinguishable": [_named(added, ports) for added in found.indistinguishable],
    }


def _named(added: Added, ports: Ports) -> dict[str, Any]:
    """Which effect it is and where it acts."""
    place = added.place
    named: dict[str, Any] = {"family": added.family, "port": ports[place]}
    if place.kind == "parameter":
        named["parameter"] = place.name
    if added.variant:
        named["variant"] = added.variant
    if place.factor is not None:
        named |= {"factor": place.factor, "level": place.level}
    return named


def _fault(fault: LogFault) -> list[dict[str, Any]]:
    """A row for each of its channels."""
    about = {
        "problem": fault.problem,
        "explains": fault.explains,
        "experiments": list(fault.experiments),
        "sentence": fault.sentence,
        "indistinguishable": [
            {"channel": channel, "problem": problem}
            for channels, problem in fault.indistinguishable
            for channel in channels
        ],
    }
    return [{"channel": channel} | about for channel in fault.channels]


def _estimate(estimate: Estimate) -> dict[str, Any]:
    return {"value": estimate.value, "unit": estimate.unit, "interval": estimate.interval}


def _own(unit: str, values: Mapping[str, float]) -> dict[str, Any]:
    each = np.array(list(values.values()))
    interval = np.quantile(each, [0.025, 0.975]).tolist()
    return {"value": each.mean(), "unit": unit, "interval": interval, "values": dict(values)}


def _gap(diagnosis: Diagnosis) -> dict[str, Any]:
    models = ("known", "reidentified", "augmented", "neural")
    return {name: getattr(diagnosis, name).gap.value for name in models} | {
        "floor": diagnosis.floor,
        "shrink": diagnosis.shrink,
        "interval": diagnosis.interval,
        "held_out": [diagnosis.logs.ids[i] for i in diagnosis.held_out],
        "horizon": diagnosis.horizon,
        "units": _units(diagnosis),
    }


def _units(diagnosis: Diagnosis) -> dict[str, Any]:
    """Errors in units of the outputs, at the horizon and over whole runs; null where a run diverges."""
    known, augmented = diagnosis.known.gap.units, diagnosis.augmented.gap.units
    return {
        name: {
            "unit": known[name].unit,
            "known": known[name].at_horizon,
            "augmented": augmented[name].at_horizon,
            "known_whole_run": known[name].whole_run,
            "augmented_whole_run": augmented[name].whole_run,
        }
        for name in known
    }


def _candidate(candidate: Candidate, ports: Ports) -> dict[str, Any]:
    """Several effects at once have their names joined, and are listed besides; no effect has no name."""
    effects = [_named(added, ports) for added in candidate.effects]
    if len(effects) == 1:
        named = effects[0]
    else:
        named = {"family": _joined(e["family"] for e in effects), "port": _joined(e["port"] for e in effects)}
        named |= {"effects": effects} if effects else {}
    return named | {"gap": candidate.gap, "evidence": 0.0 - abs(candidate.evidence)}


def _joined(names: Iterable[str]) -> str | None:
    return " + ".join(names) or None


def _plain(value: Any) -> Any:
    """`value` as JSON knows it."""
    match value:
        case Mapping():
            return {str(key): _plain(item) for key, item in value.items()}
        case list() | tuple():
            return [_plain(item) for item in value]
        case bool() | int() | str() | None:
            return value
        case np.integer():
            return int(value)
        case _:
            number = float(value)
            return float(f"{number:.{DIGITS}g}") + 0.0 if math.isfinite(number) else None
