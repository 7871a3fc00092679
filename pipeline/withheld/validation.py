"""Errors of diagnosed models on experiments that the diagnosis did not read."""

import math
from pathlib import Path

from unmodelled.base.errors import BadInput
from unmodelled.diagnosis.answer.augmented import augmented_system
from unmodelled.diagnosis.data.result import Diagnosis
from unmodelled.diagnosis.fitting.free_runs import free_runs
from unmodelled.diagnosis.fitting.own_numbers import with_own_numbers
from unmodelled.logs.folder import read_logs
from unmodelled.systems.model import System


def validated(diagnosis: Diagnosis, folder: Path) -> dict[str, float | None]:
    """Return the gaps of the `reidentified` and the `augmented` model on the experiments of a log folder.

    Numbers that differ between experiments are fitted to the first half of each; an effect in the order of
    the experiments acts as in the last diagnosed one. A gap is None where the model cannot be used.
    """
    models = {"reidentified": diagnosis.reidentified.system, "augmented": augmented_system(diagnosis)}
    return {name: gap_on(system, folder, diagnosis.horizon) for name, system in models.items()}


def gap_on(system: System, folder: Path, horizon: float) -> float | None:
    """Return the gap of a model on experiments, with a horizon in s; None where it cannot be used."""
    try:
        logs = with_own_numbers(system, read_logs(folder, system), horizon)
        value = free_runs(system, logs, horizon).value
    except BadInput:
        return None
    return value if math.isfinite(value) else None
