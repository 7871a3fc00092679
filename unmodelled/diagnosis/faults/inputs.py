"""Inputs that keep one value in some runs although the machine was driven there."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from unmodelled.diagnosis.faults.corrected_logs import Correction
from unmodelled.diagnosis.faults.questions import LogProblem, Question
from unmodelled.diagnosis.faults.suspects import Suspect
from unmodelled.diagnosis.faults.trials import OUTSTANDING_ERROR, Trials

#: Name of the problem.
NOT_RECORDED = "constant"


def unknown_inputs(trials: Trials, steps: int) -> Iterator[Suspect]:
    """Yield the runs whose outputs contradict an input that keeps one value there.

    Such a run may be right: a free swing, a step. With the physics fitted to the runs in which the input
    varies, its error is then theirs. If the input was not recorded, its error is that of the other runs once
    their input keeps this value, too; with the input that acted, the run would have their usual error. An
    error of few windows is a push.
    """
    logs = trials.logs
    spans = np.array([np.ptp(logs.u[logs.rows(i)], axis=0) for i in range(len(logs))])
    for j, name in enumerate(logs.inputs):
        still = spans[:, j] == 0.0
        if not 0 < still.sum() <= 0.5 * len(logs):
            continue
        fitted = trials.among(np.flatnonzero(~still).tolist()).refitted(steps).numbers
        shared = None if fitted is None else fitted[:1]  # the same in all runs
        known = Trials(trials.system, logs, trials.horizon, trials.sensors, trials.options, shared)
        before = known.typical(known.none, steps)
        usual, runs = float(np.median(before[~still])), np.zeros(len(logs), np.bool_)
        values = np.array([logs.u[logs.rows(i), j][0] for i in range(len(logs))])
        for value in np.unique(values[still & (before > OUTSTANDING_ERROR * usual)]).tolist():
            held = logs.u.copy()
            held[:, j] = value
            without = known.typical(Correction.replaced(logs, held), steps)
            driven = float(np.median(without[~still])) / OUTSTANDING_ERROR
            runs |= still & (values == value) & (before > max(OUTSTANDING_ERROR * usual, driven))
        if runs.any():
            question = Question(_not_recorded(np.unique(values[runs]).tolist()), (name,), known.none)
            left = known.square(known.none, steps, every=True)
            yield Suspect(question, runs, steps, left, np.where(runs, np.median(left[~still]), left))


def _not_recorded(values: Sequence[float]) -> LogProblem:
    shown = f"{values[0] + 0.0:.6g}" if len(values) == 1 else "one value"
    return LogProblem(
        *(NOT_RECORDED, 1.0, "", f"as if it were not recorded, {shown} in all samples"),
        "with an input that explains the outputs as in the other runs",
        "Check that the column is the input that drove the machine in these runs",
    )
