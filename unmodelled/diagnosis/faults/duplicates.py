"""Experiments whose logs, or single columns, are the same, sample by sample."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.diagnosis.data.result import LogFault
from unmodelled.logs.differentiate import noise, quantum
from unmodelled.logs.logs import Logs

#: Name of the problem of a column of another experiment, and smallest noise of such a column, in its range:
#: numbers of a simulation without noise can be the same in two experiments.
COPIED, NOISY = "copied", 1e-6
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


def copied_columns(logs: Logs) -> Iterator[LogFault]:
    """Yield outputs with noise that are the same in two different experiments, as far as both go."""
    known = [set(group) for group in identical(logs)]
    for j, name in enumerate(logs.outputs):
        columns = [logs.y[logs.rows(i), j] for i in range(len(logs))]
        for a, b in combinations(range(len(logs)), 2):
            length = min(len(columns[a]), len(columns[b]))
            one, other = columns[a][:length], columns[b][:length]
            if np.array_equal(one, other) and _is_noisy(one) and not any({a, b} <= group for group in known):
                ids = logs.ids[a], logs.ids[b]
                yield LogFault((name,), COPIED, None, ids, _of_copy(name, ids), True)


def _is_noisy(values: Array) -> bool:
    """Whether values (samples,) have noise, so that no second experiment has the same."""
    return quantum(values) == 0.0 and noise(values) > NOISY * float(np.ptp(values)) > 0.0


def _of_copy(name: str, ids: Sequence[str]) -> str:
    return (
        f"{name} of {ids[0]} and {ids[1]} is the same, sample by sample, although other columns differ: in "
        "one of them it is that of the other run. Check which files belong together, then diagnose again."
    )


def _sentence(ids: Sequence[str], few: bool) -> str:
    same = f"The logs of {', '.join(ids[:-1])} and {ids[-1]} are identical, sample by sample"
    if few:
        return (
            f"{same}: a model would be judged on the data that it was fitted to. Add the log of "
            "another experiment, then diagnose again."
        )
    return f"{same}: only {ids[0]} is used. Check the file names in experiments.csv."
