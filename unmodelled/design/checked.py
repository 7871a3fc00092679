"""Checks of an answer of a diagnosis before an experiment is designed from it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from unmodelled.base.errors import BadInput
from unmodelled.base.shapes import check_shape
from unmodelled.diagnosis.answer.sentences import VERDICTS
from unmodelled.diagnosis.fitting.checks import check, check_seed
from unmodelled.effects.law_files import laws_of_answer
from unmodelled.effects.own_law import Law
from unmodelled.logs.cells import LARGEST
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System

_NUMBER = (float, None)
_EFFECT = {
    "family": str,
    "port": str,
    **{"variant?": str, "parameter?": str, "factor?": (str, None), "signal?": (str, None)},
    "level?": (str, float, None),
}
#: What a design uses of diagnosis.json.
SHAPE = {
    "system": str,
    "seed": int,
    "verdict": frozenset(VERDICTS),
    "effects": [
        {
            **_EFFECT,
            "parameters": {"*": {"value": _NUMBER, "interval": [_NUMBER]}},
            "indistinguishable": [_EFFECT],
        }
    ],
    "parameters": {"*": {"identified": _NUMBER, "interval": [_NUMBER]}},
    "gap": {"horizon": float, "units": {"*": {"augmented": _NUMBER, "augmented_whole_run": _NUMBER}}},
    "where": {"experiments": [{"id": str}]},
    "laws?": [{}],
}


def check_answer(system: System, logs: Logs, answer: Mapping[str, Any]) -> tuple[Law, ...]:
    """Return the laws of an answer.

    Refuse an answer that is damaged, is of another machine or other logs, or asks to check the logs.
    """
    try:
        check_shape(Path("answer"), answer, SHAPE)
        check_seed(answer["seed"])
        _check_numbers(answer)
        laws = laws_of_answer(answer.get("laws", []), Path("answer"))
    except BadInput as fault:
        raise BadInput(f"{fault}: diagnose again") from None
    if answer["system"] != system.name:
        raise BadInput(f"answer: is of the system {answer['system']}, not of {system.name}: diagnose again")
    if answer["verdict"] == "check_logs":
        raise BadInput(
            "answer: asks to check the logs: correct them as it says and diagnose again, then plan"
        )
    _check_names(system, logs, answer)
    missing = [e["id"] for e in answer["where"]["experiments"] if e["id"] not in logs.ids]
    if missing:
        raise BadInput(f"answer: is of other logs, there is no experiment {missing[0]}: diagnose again")
    for name in logs.outputs:
        if name not in answer["gap"]["units"]:
            raise BadInput(f"answer: gap.units: has no output {name}: diagnose again")
    check(system, logs, float(answer["gap"]["horizon"]))
    return laws


def _check_names(system: System, logs: Logs, answer: Mapping[str, Any]) -> None:
    """Refuse effects at levels of a column, or beside an input, that these logs do not have."""
    known = {"factor": set(logs.experiments.columns), "signal": {item.name for item in system.inputs}}
    for k, effect in enumerate(answer["effects"]):
        for entry in (effect, *effect["indistinguishable"]):
            for key, names in known.items():
                name = entry.get(key)
                if name is not None and name not in names:
                    raise BadInput(f"answer: effects[{k}]: there is no {key} {name!r:.60}: diagnose again")


def _check_numbers(answer: Mapping[str, Any]) -> None:
    for place, number in _numbers(answer):
        interval = number.get("interval", (None, None))
        if len(interval) != 2:
            raise BadInput(f"answer: {place}: interval must be two numbers, got {len(interval)}")
        for value in (*(number.get(key) for key in ("value", "identified")), *interval):
            if value is not None and abs(value) > LARGEST:
                raise BadInput(f"answer: {place}: {float(value):g} is beyond any measurement")
    for name, each in answer["gap"]["units"].items():
        for value in (each["augmented"], each["augmented_whole_run"]):
            if value is not None and not 0.0 <= value <= LARGEST:
                raise BadInput(f"answer: gap.units.{name}: an error is 0 or more, got {float(value):g}")


def _numbers(answer: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Places and entries of the numbers of effects, and of the refitted parameters."""
    for k, effect in enumerate(answer["effects"]):
        for name, number in effect["parameters"].items():
            yield f"effects[{k}].parameters.{name}", number
    for name, number in answer["parameters"].items():
        yield f"parameters.{name}", number
