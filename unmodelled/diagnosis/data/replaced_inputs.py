"""Questions about inputs that other samples replace: of another run, or read straight between samples."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from unmodelled.base.arrays import Array, Indices
from unmodelled.diagnosis.data.corrected_logs import Correction
from unmodelled.diagnosis.data.log_questions import LogProblem, Question
from unmodelled.logs.clock import delayed
from unmodelled.logs.logs import Logs

#: Names of the problems.
SLOW, OTHER_RUN = "slow", "other_run"
#: Fewest samples between the changes of an input that is logged rarely, fewest changes of a run, and smallest
#: distance of two changes, in their median; also the share of bends of a straight course at this distance.
FEWEST_BETWEEN, FEWEST_CHANGES, REGULAR = 5, 20, 0.6
#: Change of a slope, as a share of the largest one, that stamps with few digits make, and fewest slopes of a
#: run that far apart, of a motion that was read from a slower clock: a triangle has two.
SAME_SLOPE, FEWEST_SLOPES = 0.01, 10
#: Pairs of runs in a sentence.
LISTED = 4


def slow_inputs(logs: Logs) -> Iterator[Question]:
    """Yield a question for every input that changes rarely, but at a regular pace, in all runs.

    A command may be held that long. If it is only logged that rarely, it goes on between its samples.
    """
    for j, name in enumerate(logs.inputs):
        runs = [logs.u[logs.rows(i), j] for i in range(len(logs))]
        changes = [np.flatnonzero(np.diff(u, prepend=np.nan) != 0.0) for u in runs]
        if (pace := _pace(changes)) is None:
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


def straight_pace(logs: Logs, item: int) -> float:
    """Return how many samples an input runs straight at a time, as if read from a slower clock; else 1."""
    slopes = [np.diff(logs.u[logs.rows(i), item]) for i in range(len(logs))]
    steps = [slope / (SAME_SLOPE * float(np.abs(slope).max(initial=1e-300))) for slope in slopes]
    bends = [np.flatnonzero(np.abs(np.diff(step)) > 1.0) for step in steps]
    bends = [at[np.diff(at, prepend=-2) > 1] for at in bends]  # a bend between two samples shows at both
    if (pace := _pace(bends)) is None:
        return 1.0
    often = float(np.mean(np.abs(np.concatenate([np.diff(at) for at in bends]) - pace) <= 1.0))
    few = any(len(np.unique(step[at].round())) < FEWEST_SLOPES for step, at in zip(steps, bends, strict=True))
    return 1.0 if few or often < REGULAR else pace


def _pace(changes: Sequence[Indices]) -> float | None:
    """Samples between changes that are rare and regular in all runs; None if they are not."""
    if any(len(at) < FEWEST_CHANGES for at in changes):
        return None
    pace = float(np.median(np.concatenate([np.diff(at) for at in changes])))
    regular = min(int(np.diff(at)[1:].min()) for at in changes) >= REGULAR * pace
    return pace if pace >= FEWEST_BETWEEN and regular else None


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
