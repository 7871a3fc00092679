"""Experiments whose logs are the same, sample by sample."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from unmodelled.diagnosis.data.result import LogFault
from unmodelled.logs.logs import Logs

#: Two different experiments: one to learn from, and one that is held out.
FEWEST = 2


def identical(logs: Logs) -> list[list[int]]:
    """Numbers of the experiments in groups with the same outputs and inputs, the first of each in order."""
    found: dict[bytes, list[int]] = {}
    for i in range(len(logs)):
        rows = logs.rows(i)
        found.setdefault(logs.y[rows].tobytes() + logs.u[rows].tobytes(), []).append(i)
    return list(found.values())


def different(logs: Logs) -> Logs:
    """The logs with one experiment of each group; the same logs if all are different."""
    groups = identical(logs)
    return logs if len(groups) == len(logs) else among(logs, [group[0] for group in groups])


def among(logs: Logs, runs: Sequence[int]) -> Logs:
    """Some of the experiments, by their numbers."""
    rows = np.concatenate([np.arange(*logs.offsets[[i, i + 1]]) for i in runs])
    lengths = np.diff(logs.offsets)[list(runs)]
    return replace(
        logs,
        ids=tuple(logs.ids[i] for i in runs),
        experiments=logs.experiments.iloc[list(runs)].reset_index(drop=True),
        offsets=np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64),
        **{name: getattr(logs, name)[rows] for name in ("t", "y", "u", "x")},
        c=logs.c[list(runs)],
    )


def duplicates(logs: Logs) -> tuple[LogFault, ...]:
    """A fault for every group of identical experiments.

    They decide the diagnosis where fewer than two different experiments are left: the held-out data would be
    those that the model was fitted to.
    """
    groups = identical(logs)
    few = len(groups) < FEWEST
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
            f"{same}: held-out and training data would be the same. Add the log of another experiment, then "
            "diagnose again."
        )
    return f"{same}: they count as one experiment, {ids[0]}. Check the file names in experiments.csv."
