"""Checks of an answer of a diagnosis before an experiment is designed from it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from unmodelled.base.answers import check_content
from unmodelled.base.errors import BadInput
from unmodelled.diagnosis.fitting.checks import check, check_seed
from unmodelled.effects.law_files import laws_of_answer
from unmodelled.effects.own_law import Law
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System


def check_answer(system: System, logs: Logs, answer: Mapping[str, Any]) -> tuple[Law, ...]:
    """Return the laws of an answer.

    Refuse an answer that is damaged, is of another machine or other logs, or asks to check the logs.
    """
    check_content("answer", answer, "diagnosis")
    check_seed(answer["seed"])
    laws = laws_of_answer(answer.get("laws", []), Path("answer"))
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
