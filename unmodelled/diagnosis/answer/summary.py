"""diagnosis.json (`diagnosis/2`) of a diagnosis."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from unmodelled.base.answers import SCHEMA
from unmodelled.diagnosis.answer.chain_sentences import chain_entry
from unmodelled.diagnosis.answer.compensation import compensations, file_of, is_compensated
from unmodelled.diagnosis.answer.guesses import Over, over_guesses
from unmodelled.diagnosis.answer.said_numbers import phrase, shown_number
from unmodelled.diagnosis.data.gap import Off
from unmodelled.diagnosis.data.result import (
    Compared,
    DiagnosedEffect,
    Diagnosis,
    Estimate,
    Evidence,
    LogFault,
)
from unmodelled.diagnosis.gates.refusal import Refusal
from unmodelled.diagnosis.where.effect_channels import channel_of
from unmodelled.diagnosis.where.where import Where
from unmodelled.effects.added import Added
from unmodelled.effects.library import kind_of
from unmodelled.effects.place import Place
from unmodelled.systems.model import System

if TYPE_CHECKING:  # loads all laws, of which the list of answers needs none
    from unmodelled.diagnosis.answer.robot_file import RobotFile

Ports = Mapping[Place, str]

NONE: Mapping[str, Over] = {}
#: Significant digits of a number.
DIGITS = 8


def summary(
    diagnosis: Diagnosis, where: Where, robot: RobotFile | None = None, refused: Sequence[Refusal] = ()
) -> dict[str, Any]:
    """Return the content of diagnosis.json: numbers, texts, lists and mappings; null for undefined numbers.

    Beside the entries of the contract it has: `text` of an effect, and `shown` of its numbers and of the
    errors of an output, as a person says them in the units of the logs, where that differs; `compensation` of
    an effect, the name of the table that compensates the error of its sensor; `remarks` of a number that is
    doubtful, their kinds (`Remark`); `spread` of a fitted number, from which intervals of any level follow;
    `fit`, how the fit of the numbers ended (`FitEnd`), with the `seconds` of the diagnosis where they are
    known; `only_with`, the effects without which an effect hardly lowers the error; `variant` of an effect
    that has several; `parameter` of an effect on a parameter, whose port is where the parameter
    acts; `values` by experiment of a number that differs between experiments, whose `value` and
    `interval` are their mean and 95 % range; `chance`, see `Diagnosis`; `refused`, the files that are not
    offered, with the file to `keep`; `robot` of a system with a robot file (`RobotFile.content`).
    Where laws were compared by evidence: `kind` and `probability` of an effect and of those in
    `indistinguishable` (the probabilities add up to the confidence of the effect); `evidence`, of laws by
    length of the windows; `chain`, how the logs were made; `strangers`, ids of experiments that follow no
    named effect; `alike`, the law that is most like what is left where none is named.
    `logs` lists faults of the logs, a row per channel with a sentence, the faulty `experiments` (empty: all)
    and `indistinguishable` faults. A saved answer also has `sources`, the paths of `system` and `logs`. With
    the verdict check_logs nothing was fitted: all gaps are those of the known model.
    """
    ports, files = _ports(diagnosis), compensations(diagnosis)
    over = {} if diagnosis.verdict == "check_logs" else over_guesses(diagnosis)
    content = {
        "schema": SCHEMA,
        "system": diagnosis.system.name,
        "seed": diagnosis.seed,
        "verdict": diagnosis.verdict,
        "confidence": diagnosis.confidence,
        "chance": diagnosis.chance,
        "effects": [_effect(found, ports, files, over) for found in diagnosis.effects],
        "remainder": _remainder(diagnosis),
        "where": {
            name: list(getattr(where, name)) for name in ("channels", "regions", "factors", "experiments")
        },
        "gap": _gap(diagnosis),
        "parameters": {
            name: {"known": e.known, "identified": e.value} | _about(e, ("guess",) if name in over else ())
            for name, e in diagnosis.parameters.items()
        },
        "comparison": [_compared(one, ports, diagnosis.system) for one in diagnosis.comparison],
        "logs": [row for fault in diagnosis.faults for row in _fault(fault)],
        "notes": list(diagnosis.notes),
        "refused": [refusal.content for refusal in refused],
        **({} if robot is None else {"robot": robot.content}),
        **({} if diagnosis.fit is None else {"fit": vars(diagnosis.fit)}),
        **_by_evidence(diagnosis, ports),
    }
    return {name: _plain(value) for name, value in content.items()}


def _ports(diagnosis: Diagnosis) -> dict[Place, str]:
    """Where effects act: that of a parameter at the port, input or sensor that the parameter belongs to."""
    added = [e for found in diagnosis.effects for e in (found.added, *found.indistinguishable)]
    added += [one.added for one in (*diagnosis.evidence, *filter(None, [diagnosis.alike]))]
    places = {e.place for e in (*added, *(e for c in diagnosis.comparison for e in c.effects))}
    return {place: channel_of(diagnosis.reidentified, place) for place in places}


def _effect(
    found: DiagnosedEffect, ports: Ports, files: Collection[str] = (), over: Mapping[str, Over] = NONE
) -> dict[str, Any]:
    numbers = {
        name: {"value": estimate.value} | _about(estimate) for name, estimate in found.estimates.items()
    }
    numbers |= {name: _own(found.added.units[name], values) for name, values in found.own.items()}
    text, file = phrase(found, over), file_of(found.added) if is_compensated(found) else ""
    own, *others = _likely(found)
    return (
        _named(found.added, ports)
        | own
        | {
            "law": _law(found),
            **({"text": text} if text else {}),
            **({"compensation": file} if file in files else {}),
            "parameters": {
                name: {**each, **shown_number(found.added, name, each, over.get(name))}
                for name, each in numbers.items()
            },
            "confidence": found.confidence,
            "shrink": found.shrink,
            "interval": found.interval,
            "indistinguishable": [
                _named(added, ports) | likely
                for added, likely in zip(found.indistinguishable, others, strict=True)
            ],
            **({"only_with": [_named(added, ports) for added in found.only_with]} if found.only_with else {}),
        }
    )


def _law(found: DiagnosedEffect) -> str:
    """The law in names of the augmented system, in which a number that was wrong has its right value."""
    added = found.added
    if not added.is_other_value:
        return added.law
    (error,) = added.amplitudes
    return f"{added.place.name} = {added.told[error].shift + found.estimates[error].value:.4g}"


def _likely(found: DiagnosedEffect) -> list[dict[str, Any]]:
    """Kind and probability of a law and of those that the logs cannot tell from it, where they are known."""
    laws = found.added, *found.indistinguishable
    likely: list[dict[str, Any]] = [{} for _ in laws]
    if found.kind:
        likely = [{"kind": kind_of(added)} for added in laws]
    if whole := sum(found.probabilities):
        shares = [found.confidence * each / whole for each in found.probabilities]
        likely = [one | {"probability": share} for one, share in zip(likely, shares, strict=True)]
    return likely


def _by_evidence(diagnosis: Diagnosis, ports: Ports) -> dict[str, Any]:
    """What an answer has besides where laws were compared by evidence."""
    alike = diagnosis.alike
    found: dict[str, Any] = {
        "chain": [chain_entry(part) for part in diagnosis.chain],
        "evidence": [_evidence(one, ports) for one in diagnosis.evidence],
        "alike": {} if alike is None else _evidence(alike, ports) | {"kind": kind_of(alike.added)},
        "strangers": list(diagnosis.strangers),
    }
    return {name: entries for name, entries in found.items() if entries}


def _evidence(one: Evidence, ports: Ports) -> dict[str, Any]:
    numbers = {name: getattr(one, name) for name in ("horizon", "nats", "removed")}
    return _named(one.added, ports) | numbers


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
    if place.signal is not None:
        named["signal"] = place.signal
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


def _about(estimate: Estimate, more: Sequence[str] = ()) -> dict[str, Any]:
    """Unit and uncertainty of a number, with further kinds of remarks."""
    found = {name: getattr(estimate, name) for name in ("unit", "interval", "determined", "at_bound")}
    remarks = [*estimate.remarks, *more]
    found |= {"remarks": remarks} if remarks else {}
    return found if estimate.spread is None else found | {"spread": vars(estimate.spread)}


def _own(unit: str, values: Mapping[str, float]) -> dict[str, Any]:
    each = np.array(list(values.values()))
    interval = np.quantile(each, [0.025, 0.975]).tolist()
    return {"value": each.mean(), "unit": unit, "interval": interval, "values": dict(values)}


def _gap(diagnosis: Diagnosis) -> dict[str, Any]:
    models = ("known", "reidentified", "augmented", "neural")
    return {name: getattr(diagnosis, name).gap.value for name in models} | {
        "floor": diagnosis.floor,
        "persistence": diagnosis.known.gap.persistence,
        "shrink": diagnosis.shrink,
        "interval": diagnosis.interval,
        "held_out": [diagnosis.logs.ids[i] for i in diagnosis.held_out],
        "horizon": diagnosis.horizon,
        "units": _units(diagnosis),
    }


def _units(diagnosis: Diagnosis) -> dict[str, Any]:
    """Errors in units of the outputs, at the horizon and over whole runs; null where a run diverges."""
    known, augmented = diagnosis.known.gap.units, diagnosis.augmented.gap.units
    found = {name: _errors(off, augmented[name]) for name, off in known.items()}
    for name, off in known.items():
        if off.as_logged.unit != off.unit:
            found[name]["shown"] = _errors(off.as_logged, augmented[name].as_logged)
    return found


def _errors(known: Off, augmented: Off) -> dict[str, Any]:
    return {
        "unit": known.unit,
        "known": known.at_horizon,
        "augmented": augmented.at_horizon,
        "known_whole_run": known.whole_run,
        "augmented_whole_run": augmented.whole_run,
    }


def _remainder(diagnosis: Diagnosis) -> dict[str, Any] | None:
    found = diagnosis.remainder
    if found is None:
        return None
    channel = None if found.place is None else channel_of(diagnosis.reidentified, found.place)
    return {"share": found.share, "predictable": found.predictable, "channel": channel}


def _compared(candidate: Compared, ports: Ports, system: System) -> dict[str, Any]:
    """A candidate, with its errors in the units of the outputs' columns."""
    numbers = ("score", "difference", "standard_error", "named", "probability")
    effects = [_named(added, ports) | {"kind": kind_of(added)} for added in candidate.effects]
    found = {"effects": effects, **{name: getattr(candidate, name) for name in numbers}}
    if not candidate.errors:
        return found
    columns = {output.name: output.as_difference for output in system.outputs}
    errors = {
        name: {"value": error / columns[name].factor, "unit": columns[name].text}
        for name, error in candidate.errors.items()
    }
    return found | {"errors": errors, "horizon": candidate.horizon}


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
