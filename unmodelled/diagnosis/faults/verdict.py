"""From suspects to the fault: errors with fitted parameters, the best suspect, and the fault in words."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from unmodelled.base.arrays import Array, Mask
from unmodelled.diagnosis.data.options import Options
from unmodelled.diagnosis.data.remark import listed
from unmodelled.diagnosis.data.result import LogFault
from unmodelled.diagnosis.faults.questions import Question
from unmodelled.diagnosis.faults.suspects import Suspect, explained_by_law
from unmodelled.diagnosis.faults.trials import EQUAL_ERROR_RATIO, Trials


def where(before: Array, after: Array, options: Options) -> Iterator[Mask]:
    """Yield masks (experiments,): all, and the few whose error the correction removes almost completely."""
    yield np.ones(len(before), np.bool_)
    some = after < (1.0 - options.fault_share) * before
    if 0 < some.sum() < 0.5 * len(some):
        yield some


def only(question: Question, runs: Mask, steps: int, before: Array, after: Array) -> Suspect:
    """Return the suspect that a question makes in some runs: mask and errors (experiments,)."""
    mine = Question(question.problem, question.channels, question.correction.only(runs))
    return Suspect(mine, runs, steps, before, np.where(runs, after, before))


def best_of(trials: Trials, right: Sequence[Suspect]) -> list[Suspect]:
    """Return the suspects with almost the smallest error, that of the fewest channels (first asked) first.

    Errors are those of the experiments that any of them corrects: parameters that are fitted to a wrong
    correction change those of the others, too.
    """
    where = np.any([s.runs for s in right], axis=0)
    left = [s.after[where].sum() / trials.persistence(s.steps, not s.everywhere)[where].sum() for s in right]
    most = EQUAL_ERROR_RATIO * min(left)
    alike = (s for s, each in zip(right, left, strict=True) if each <= most)
    return sorted(alike, key=lambda s: len(s.question.channels))


def identified(trials: Trials, suspect: Suspect) -> Suspect:
    """Return a suspect with errors of fitted parameters, with and without its correction.

    For a fault of some experiments all windows count: of a few, one that starts at a bad sample would decide.
    """
    both, every = (trials.none, suspect.question.correction), not suspect.everywhere
    before, after = (trials.identified(c, suspect.steps, every) for c in both)
    return replace(suspect, before=before, after=after)


def is_good(trials: Trials, suspect: Suspect) -> bool:
    """Return whether the corrected model predicts well, and no law explains as much."""
    left, every = float(suspect.after[suspect.runs].sum()), not suspect.everywhere
    # outputs that are replaced by smoother ones are easier to predict, by the model and without
    read = suspect.question.correction
    given = (trials.none,) if read.outputs is None else (trials.none, read)
    nothing = min(float(trials.persistence(suspect.steps, every, c)[suspect.runs].sum()) for c in given)
    useful = left <= trials.options.useful_error**2 * nothing
    return useful and not explained_by_law(trials, suspect)


def fault_of(trials: Trials, best: Suspect, alike: Sequence[Suspect]) -> LogFault:
    """Return the fault that a suspect is, beside those that the logs cannot tell from it."""
    ids = trials.logs.ids
    return LogFault(
        channels=best.question.channels,
        problem=best.question.problem.name,
        explains=best.explains,
        experiments=() if best.everywhere else tuple(ids[i] for i in np.flatnonzero(best.runs)),
        sentence=_sentence(trials, best, alike),
        decides=True,
        indistinguishable=tuple((s.question.channels, s.question.problem.name) for s in alike),
    )


def _sentence(trials: Trials, best: Suspect, alike: Sequence[Suspect]) -> str:
    """Return observation, correction with its effect on the error, and the next step."""
    logs, question = trials.logs, best.question
    channels, problem, runs = question.channels, question.problem, np.flatnonzero(best.runs)
    of = "" if best.everywhere else f" of {listed([logs.ids[i] for i in runs])}"
    found = f"{listed(channels)}{of} {'look' if len(channels) > 1 else 'looks'} {problem.looks}"
    old, new = (np.sqrt(square[best.runs].mean()) for square in (best.before, best.after))
    falls = f"the known model's error falls from {old:.2g} to {new:.2g} standard deviations within a run"
    said = f"{found}: {problem.done}, {falls}."
    if alike:
        others = (f"{listed(s.question.channels)} ({s.question.problem.name})" for s in alike)
        said += f" These logs cannot distinguish it from {' or '.join(others)}."
    return f"{said} {problem.cure}, then diagnose again."
