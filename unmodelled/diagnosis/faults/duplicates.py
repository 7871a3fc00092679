"""Experiments whose logs are the same, sample by sample."""

from __future__ import annotations

from collections.abc import Sequence

from unmodelled.diagnosis.data.result import LogFault
from unmodelled.logs.logs import Logs

#: Different experiments at least: one to fit, and one that is left out.
FEWEST_DIFFERENT = 2


def identical(logs: Logs) -> list[list[int]]:
    """Return the numbers of the experiments in groups of equal outputs and inputs."""
    found: dict[bytes, list[int]] = {}
    for i in range(len(logs)):
        rows = logs.rows(i)
        found.setdefault(logs.y[rows].tobytes() + logs.u[rows].tobytes(), []).append(i)
    return list(found.values())


def different(logs: Logs) -> Logs:
    """Return the logs with the first experiment of each group of identical ones."""
    groups = identical(logs)
    return logs if len(groups) == len(logs) else logs.among([group[0] for group in groups])


def duplicates(logs: Logs) -> tuple[LogFault, ...]:
    """Return a fault for every group of identical experiments; it decides if no two different ones remain."""
    groups = identical(logs)
    few = len(groups) < FEWEST_DIFFERENT
    return tuple(
        LogFault(
            channels=("experiments",),
            problem="identical",
            explains=None,
            experiments=tuple(logs.ids[i] for i in group),
            sentence=_sentence([logs.ids[i] for i in group], few),
            decides=few,
        )
        for group in groups
        if len(group) > 1
    )


def _sentence(ids: Sequence[str], few: bool) -> str:
    same = f"The logs of {', '.join(ids[:-1])} and {ids[-1]} are identical, sample by sample"
    if few:
        return (
            f"{same}: a model would be judged on the data that it was fitted to. Add the log of "
            "another experiment, then diagnose again."
        )
    return f"{same}: only {ids[0]} is used. Check the file names in experiments.csv."
