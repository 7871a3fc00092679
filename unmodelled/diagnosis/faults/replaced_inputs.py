"""Questions about inputs that other samples replace: of another run, or read straight between samples."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from unmodelled.base.arrays import Array, Indices
from unmodelled.diagnosis.data.input_pace import regular_pace
from unmodelled.diagnosis.faults.corrected_logs import Correction
from unmodelled.diagnosis.faults.questions import LogProblem, Question
from unmodelled.logs.clock import delayed
from unmodelled.logs.logs import Logs

#: Names of the problems.
SLOW, OTHER_RUN = "slow", "other_run"
#: Pairs of runs in a sentence.
LISTED = 4


def slow_inputs(logs: Logs) -> Iterator[Question]:
    """Yield a question for every input that changes rarely, but at a regular pace, in all runs.

    A command may be held that long. If it is only logged that rarely, it goes on between its samples.
    """
    for j, name in enumerate(logs.inputs):
        runs = [logs.u[logs.rows(i), j] for i in range(len(logs))]
        changes = [np.flatnonzero(np.diff(u, prepend=np.nan) != 0.0) for u in runs]
        if (pace := regular_pace(changes)) is None:
            continue
        read = logs.u.copy()
        straight = [np.interp(np.arange(len(u)), at, u[at]) for u, at in zip(runs, changes, strict=True)]
        read[:, j] = np.concatenate(straight)
        problem = LogProblem(
            *(SLOW, 1.0, ""),
            f"as if it were logged only every {pace * logs.period:.3g} s ({pace:.0f} samples) and not held",
            "read straight between these samples",
            "Log it as often as the outputs",
        )
        yield Question(problem, (name,), Correction.replaced(logs, read))


def inputs_of_other_runs(logs: Logs, shift: int) -> Array:
    """Return the inputs (samples, inputs) of the run some places further on, held at their end."""
    lengths, found = np.diff(logs.offsets), np.empty_like(logs.u)
    for i in range(len(logs)):
        other = (i + shift) % len(logs)
        found[logs.rows(i)] = logs.u[
            logs.offsets[other] + np.minimum(np.arange(lengths[i]), lengths[other] - 1)
        ]
    return found


def later_inputs(logs: Logs, samples: int) -> Correction:
    """Return the correction that lets inputs act some samples later, held at the ends of every run."""
    late = [samples * logs.period] * len(logs.inputs)
    return Correction.replaced(logs, delayed(logs.u, logs.offsets, logs.period, late, "linear"))


def other_run(logs: Logs, shifts: Indices) -> Question:
    """Return the question whether runs have the inputs of others, by shifts (experiments,)."""
    read = logs.u.copy()
    for shift in np.unique(shifts[shifts != 0]).tolist():
        mine = (shifts == shift)[logs.owner]
        read[mine] = inputs_of_other_runs(logs, shift)[mine]
    changed = np.flatnonzero(shifts)[:LISTED]
    pairs = [f"{logs.ids[i]} that of {logs.ids[(i + shifts[i]) % len(logs)]}" for i in changed.tolist()]
    problem = LogProblem(
        *(OTHER_RUN, 1.0, "", "as if it came from another run", f"given to {', '.join(pairs)}"),
        "Check which files belong together",
    )
    return Question(problem, logs.inputs, Correction.replaced(logs, read))
