"""Questions about columns that other samples replace: of another run, or read straight between samples."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from unmodelled.base.arrays import Array, Indices
from unmodelled.diagnosis.data.input_pace import regular_pace
from unmodelled.diagnosis.faults.corrected_logs import Correction
from unmodelled.diagnosis.faults.questions import LogProblem, Question
from unmodelled.logs.clock import delayed
from unmodelled.logs.inspection.register import KIND as REGISTER
from unmodelled.logs.inspection.register import registers_of_steps
from unmodelled.logs.inspection.signal import signals_of
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System

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


def signed_steps(system: System, logs: Logs) -> Iterator[Question]:
    """Yield a question for every input in steps whose levels may be signed numbers, read as unsigned."""
    for signal in (each for each in signals_of(system) if each.role == "input"):
        j = logs.inputs.index(signal.name)
        for kind in registers_of_steps(logs.u[:, j], signal):
            read = logs.u.copy()
            read[:, j] = kind.decoded(read[:, j])
            low, high = (signal.shown(float(end)) for end in (read[:, j].min(), read[:, j].max()))
            looks = "signed numbers" if kind.complement else "numbers whose highest bit is the sign,"
            problem = LogProblem(
                *(REGISTER, 1.0, "", f"like {looks} that were read as unsigned"),
                f"decoded, from {low} to {high}",
                "Log the signed number",
            )
            yield Question(problem, (signal.name,), Correction.replaced(logs, read))


def of_other_runs(logs: Logs, values: Array, shift: int) -> Array:
    """Return columns (samples, n) of the run some places further on, held at their end."""
    lengths, found = np.diff(logs.offsets), np.empty_like(values)
    for i in range(len(logs)):
        other = (i + shift) % len(logs)
        found[logs.rows(i)] = values[
            logs.offsets[other] + np.minimum(np.arange(lengths[i]), lengths[other] - 1)
        ]
    return found


def with_other_runs(logs: Logs, shifts: Indices, output: int | None = None) -> Correction:
    """Return the correction that gives runs the inputs, or an output, of others; shifts (experiments,)."""
    logged = logs.u if output is None else logs.y
    read, columns = logged.copy(), slice(None) if output is None else output
    for shift in np.unique(shifts[shifts != 0]).tolist():
        mine = (shifts == shift)[logs.owner]
        read[mine, columns] = of_other_runs(logs, logged, shift)[mine, columns]
    if output is None:
        return Correction.replaced(logs, read)
    return replace(Correction.none(logs), outputs=read, owner=logs.owner)


def later_inputs(logs: Logs, samples: int) -> Correction:
    """Return the correction that lets inputs act some samples later, held at the ends of every run."""
    late = [samples * logs.period] * len(logs.inputs)
    return Correction.replaced(logs, delayed(logs.u, logs.offsets, logs.period, late, "linear"))


def other_run(logs: Logs, shifts: Indices, output: int | None = None) -> Question:
    """Return the question whether runs have the inputs, or an output, of others, by shifts (experiments,)."""
    changed = np.flatnonzero(shifts)[:LISTED]
    pairs = [f"{logs.ids[i]} that of {logs.ids[(i + shifts[i]) % len(logs)]}" for i in changed.tolist()]
    problem = LogProblem(
        *(OTHER_RUN, 1.0, "", "as if it came from another run", f"given to {', '.join(pairs)}"),
        "Check which files belong together",
    )
    channels = logs.inputs if output is None else (logs.outputs[output],)
    return Question(problem, channels, with_other_runs(logs, shifts, output))
