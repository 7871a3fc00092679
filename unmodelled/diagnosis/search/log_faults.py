"""Faults of logs that explain the gap: units, signs, offsets, clocks, copies.

All questions are answered by one principle: the known physics, quickly re-identified, runs free under the
corrected logs. A fault explains the share by which the mean square error falls.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from unmodelled.diagnosis.data.duplicates import different, duplicates
from unmodelled.diagnosis.data.gap import steps_of
from unmodelled.diagnosis.data.log_questions import (
    NO_EFFECT,
    Question,
    clocks,
    constants,
    moves_without_input,
    questions,
    without_inputs,
)
from unmodelled.diagnosis.data.persistence import default_horizon
from unmodelled.diagnosis.data.replaced_inputs import later_inputs, slow_inputs
from unmodelled.diagnosis.data.result import LogFault
from unmodelled.diagnosis.data.sensors import Sensors
from unmodelled.diagnosis.data.thresholds import DEFAULT_THRESHOLDS, Thresholds
from unmodelled.diagnosis.search.log_copies import command_notes, copies, notes
from unmodelled.diagnosis.search.log_fits import (
    CLOCK_PROBLEM,
    of_every,
    of_one,
    swapped,
    with_free_numbers,
    with_friction,
    with_inertia,
    with_springs,
)
from unmodelled.diagnosis.search.log_trials import QUESTION_SAMPLES, Trials
from unmodelled.logs.inspection.pairs import commands_as_outputs
from unmodelled.logs.inspection.related import is_related
from unmodelled.logs.logs import Logs
from unmodelled.logs.preparation import prepare
from unmodelled.systems.model import System

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: Horizons that are tried one after the other, in units of the given one: within a short horizon a true model
#: may be hardly better than no model.
HORIZON_FACTORS = 1.0, 4.0
#: Horizons up to which an input acts.
MEMORY = 2
#: Times by which inputs may act later in one experiment, in horizons, and their gains there.
LATER, GAINS = np.linspace(-1.0, 1.0, 21), np.linspace(0.5, 1.5, 21)
#: Corrections that are re-identified, the most promising ones (a budget).
REIDENTIFIED = 3
#: Squared error, in that of persistence, from which the known physics is of no use: units and inputs may be
#: far off. With steps that are a thousand times too short, it is a prediction that keeps the speed.
USELESS = 0.5


@dataclass(frozen=True, eq=False)
class _Suspect:
    """A correction of some experiments that may explain the gap.

    Attributes:
        question: question whose correction changes only the experiments in `runs`.
        runs: mask of the corrected experiments, shape (experiments,).
        steps: number of samples of a window.
        before: mean square errors of the logs as read, shape (experiments,).
        after: mean square errors of the corrected logs, shape (experiments,).
    """

    question: Question
    runs: Mask
    steps: int
    before: Array
    after: Array

    @property
    def explains(self) -> float:
        """Return the explained share of the mean square error of all experiments."""
        whole = float(self.before.sum())
        return 1.0 - float(self.after.sum()) / whole if whole > 0.0 else 0.0

    @property
    def everywhere(self) -> bool:
        return bool(self.runs.all())

    @property
    def explains_where_it_is(self) -> float:
        """Return the explained share of the mean square error of the corrected experiments."""
        return 1.0 - float(self.after[self.runs].sum()) / max(float(self.before[self.runs].sum()), 1e-300)

    def is_enough(self, limits: Thresholds) -> bool:
        """Return whether the fault explains most of the error of its experiments, and enough of all error."""
        most, some = limits.fault_share, limits.fault_share_some
        return self.explains_where_it_is >= most and self.explains >= some


def without_copies(
    system: System, logs: Logs, horizon: float, thresholds: Thresholds = DEFAULT_THRESHOLDS
) -> tuple[System, Logs, tuple[LogFault, ...]]:
    """Return system and logs without computed outputs; and all faults.

    Such an output, for example a speed that a drive has differenced and smoothed, is no second sensor: what
    it shows beyond the output that it is computed from is its filter.

    Takes horizon in s.
    """
    found = copies(different(logs), thresholds)
    commands = commands_as_outputs(system, logs.y, logs.u, logs.offsets)
    alone = len(commands) == len(logs.outputs)
    said = (*notes(logs, found), *command_notes(logs, commands, alone))
    if alone:
        return system, logs, said
    if found or commands:
        kept = sorted({*range(len(logs.outputs))} - {copy.target for copy in found} - {*commands})
        system = replace(system, outputs=tuple(system.outputs[k] for k in kept))
        shown = tuple(logs.outputs[k] for k in kept)
        logs = prepare(system, replace(logs, outputs=shown, y=logs.y[:, kept]))
    return system, logs, (*said, *log_faults(system, logs, horizon, thresholds))


def log_faults(
    system: System, logs: Logs, horizon: float, thresholds: Thresholds = DEFAULT_THRESHOLDS
) -> tuple[LogFault, ...]:
    """Find faults of the logs, and the fault that explains most of the gap if there is one.

    Examples:
        >>> from dataclasses import replace
        >>> import unmodelled as um
        >>> system, logs = um.example("pendulum")
        >>> log_faults(system, logs, horizon=0.2)
        ()
        >>> reversed_torque = replace(logs, u=-logs.u)
        >>> [(fault.channels, fault.problem) for fault in log_faults(system, reversed_torque, horizon=0.2)]
        [(('torque',), 'sign')]
    """
    found = different(logs)
    answer = _answer(system, found, horizon, thresholds)
    said = [
        note
        for note in constants(found)
        if not answer or (note.problem, note.channels) != (answer[0].problem, answer[0].channels)
    ]
    if not answer and said and moves_without_input(found) and _far_off(system, found, horizon, thresholds):
        said = [replace(note, decides=True) for note in said]
    if not answer and not any(note.decides for note in said):
        answer = _unrelated(system, found, horizon, thresholds)
    return *duplicates(logs), *said, *answer


def _unrelated(system: System, logs: Logs, horizon: float, thresholds: Thresholds) -> tuple[LogFault, ...]:
    """Return the fault that the inputs have nothing to do with the outputs, as a tuple of one, or none.

    The model is worse with these inputs than without any, and random signals of their spectrum predict the
    outputs as well.
    """
    if not logs.inputs:
        return ()
    trials = Trials(system, logs, horizon, Sensors(logs), thresholds)
    question, steps = without_inputs(logs), trials.steps(trials.none)
    before, after = (trials.square(c, steps) for c in (trials.none, question.correction))
    suspect = _Suspect(question, np.ones(len(logs), np.bool_), steps, before, after)
    if not suspect.explains > thresholds.suspect_share or is_related(logs, MEMORY * steps):
        return ()
    return (_fault(trials, suspect, ()),)


def _far_off(system: System, logs: Logs, horizon: float, thresholds: Thresholds) -> bool:
    """Return whether the known physics, refitted, is hardly better than no model."""
    trials = Trials(system, logs, horizon, Sensors(logs), thresholds)
    steps = trials.steps(trials.none)
    left, nothing = trials.identified(trials.none, steps), trials.persistence(steps)
    return float(left.sum()) > (1.0 - thresholds.fault_share) * float(nothing.sum())


def _answer(system: System, logs: Logs, horizon: float, thresholds: Thresholds) -> tuple[LogFault, ...]:
    """Return the fault that explains the gap, as a tuple of one, or none."""
    sensors = Sensors(logs)
    for longer in HORIZON_FACTORS:
        trials = Trials(system, logs, longer * horizon, sensors, thresholds)
        suspects = [*_suspects(trials), *(_fits(trials) if longer == 1.0 else ())]
        few = sorted(s.explains for s in suspects)[-REIDENTIFIED:]
        tried = (_identified(trials, s) for s in suspects if s.explains >= few[0])
        right = [s for s in tried if s.is_enough(thresholds) and _good(trials, s)]
        if right:
            best, *alike = _best(trials, right)
            return (_fault(trials, best, alike),)
    return ()


def _suspects(trials: Trials) -> Iterator[_Suspect]:
    logs, steps = trials.logs, trials.steps(trials.none)
    before, nothing = trials.square(trials.none, steps), trials.persistence(steps)
    if not _matters(before, nothing, trials.thresholds):
        return
    for question in questions(trials.system, logs, before.sum() > USELESS * nothing.sum()):
        after = trials.square(question.correction, steps)
        for runs in _where(before, after, trials.thresholds):
            suspect = _only(question, runs, steps, before, after)
            if suspect.explains > trials.thresholds.suspect_share and _possible(trials, suspect):
                yield suspect
    exchanged = swapped(trials, steps, before) if np.any(before > USELESS * nothing) else ()
    for question in (*slow_inputs(logs), *exchanged):
        after = trials.square(question.correction, steps)
        yield _only(question, question.correction.corrected, steps, before, after)
    # a right clock, a thousand times faster, would make one window of every experiment; the number of
    # samples of the default horizon does not depend on the clock
    most = max(1, min(steps_of(default_horizon(logs, trials.sensors), logs), QUESTION_SAMPLES // len(logs)))
    for question in clocks(trials.system, logs):
        fast = question.problem.factor < 1.0
        if before.sum() <= (1.0 if fast else USELESS) * nothing.sum():
            continue  # its clock cannot be a thousand times off
        steps = min(trials.steps(question.correction), most) if fast else most
        old, new = (trials.square(c, steps) for c in (trials.none, question.correction))
        yield _Suspect(question, np.ones(len(logs), np.bool_), steps, old, new)


def _fits(trials: Trials) -> Iterator[_Suspect]:
    """Yield corrections with a fitted size; over a long horizon they also fit errors of other causes.

    One experiment stands out once the uncertain parameters are fitted to all: before, wrong numbers leave
    errors everywhere.
    """
    steps = trials.steps(trials.none)
    before, nothing = trials.square(trials.none, steps), trials.persistence(steps)
    if not _matters(before, nothing, trials.thresholds):
        return
    known = trials.refitted(steps)
    left = known.square(known.none, steps, every=True)
    alone = of_one(known, steps, left) if _matters(left, nothing, trials.thresholds) else ()
    every = (trials, before, of_every(trials, steps), False)
    for tried, old, question, whole in (every, *((known, left, q, True) for q in alone)):
        after = tried.square(question.correction, steps, whole)
        suspect = _only(question, question.correction.corrected, steps, old, after)
        if suspect.explains > trials.thresholds.suspect_share:
            yield suspect


def _matters(square: Array, nothing: Array, limits: Thresholds) -> bool:
    """Return whether the error of an experiment matters beside that of persistence in all."""
    return float(square.max()) >= limits.negligible_error**2 * float(np.median(nothing))


def _where(before: Array, after: Array, limits: Thresholds) -> Iterator[Mask]:
    """Yield all experiments, and the few whose error the correction removes almost completely."""
    yield np.ones(len(before), np.bool_)
    some = after < (1.0 - limits.fault_share) * before
    if 0 < some.sum() < 0.5 * len(some):
        yield some


def _only(question: Question, runs: Mask, steps: int, before: Array, after: Array) -> _Suspect:
    mine = Question(question.problem, question.channels, question.correction.only(runs))
    return _Suspect(mine, runs, steps, before, np.where(runs, after, before))


def _possible(trials: Trials, suspect: _Suspect) -> bool:
    """Return whether an input without effect explains more than an input with a small effect.

    The error is a parabola of the input's gain: where its lowest point is near zero, a little of the input or
    of its opposite is worse than none.
    """
    if suspect.question.problem is not NO_EFFECT:
        return True
    correction, gain = suspect.question.correction, trials.thresholds.little_input
    little = (np.where(correction.drive == 0.0, each, correction.drive) for each in (gain, -gain))
    squares = [trials.square(replace(correction, drive=drive), suspect.steps) for drive in little]
    return all(suspect.after[suspect.runs].sum() < square[suspect.runs].sum() for square in squares)


def _best(trials: Trials, right: Sequence[_Suspect]) -> list[_Suspect]:
    """Return the suspects with almost the smallest error, the simplest (first asked) one first."""
    left = [s.after.sum() / trials.persistence(s.steps, not s.everywhere).sum() for s in right]
    return [
        s
        for s, each in zip(right, left, strict=True)
        if each <= trials.thresholds.equal_error_ratio * min(left)
    ]


def _identified(trials: Trials, suspect: _Suspect) -> _Suspect:
    """Return a suspect with errors of fitted parameters, with and without its correction.

    For a fault of some experiments all windows count: of a few, one that starts at a bad sample would decide.
    """
    both, every = (trials.none, suspect.question.correction), not suspect.everywhere
    before, after = (trials.identified(c, suspect.steps, every) for c in both)
    return replace(suspect, before=before, after=after)


def _good(trials: Trials, suspect: _Suspect) -> bool:
    """Return whether the corrected model predicts well, and no law explains as much."""
    left = float(suspect.after[suspect.runs].sum())
    persistence = trials.persistence(suspect.steps, not suspect.everywhere)[suspect.runs].sum()
    useful = left <= trials.thresholds.useful_error**2 * float(persistence)
    return useful and not _law(trials, suspect)


def _law(trials: Trials, suspect: _Suspect) -> bool:
    """Return whether a law explains as much as a wrong clock.

    If the clock of all experiments is wrong, it is another inertia, such as that of a rotor, with dry
    friction, or a wrong number of the file. If that of one experiment is, it is stiffening springs, or what
    acts on this experiment.
    """
    if suspect.question.problem.name != CLOCK_PROBLEM:
        return False
    system, logs, every = trials.system, trials.logs, not suspect.everywhere
    if suspect.everywhere:
        others = [with_friction(with_inertia(system), logs), *with_free_numbers(system)]
    elif _acts_otherwise(trials, suspect):
        return True
    else:
        others = [with_springs(system, logs)]

    def left(other: System) -> float:
        found = Trials(other, logs, trials.horizon, trials.sensors, trials.thresholds)
        return float(found.identified(found.none, suspect.steps, every).sum())

    most = trials.thresholds.clock_error_ratio * float(suspect.after.sum())
    return any(left(other) < most for other in others)


def _acts_otherwise(trials: Trials, suspect: _Suspect) -> bool:
    """Return whether inputs that act later, or with another gain, explain what a clock of one run does.

    The time of a flow depends on the flow: with later inputs, the experiment stands out no more. A supply
    varies from run to run: with another gain, hardly more is left than with another clock.
    """
    (run,), limits = np.flatnonzero(suspect.runs).tolist(), trials.thresholds
    alone = trials.refitted(suspect.steps).alone(run)
    times = np.unique(np.rint(LATER * suspect.steps)).astype(int).tolist()
    later = (later_inputs(alone.logs, samples) for samples in times)
    stronger = (replace(alone.none, drive=gain * alone.none.drive) for gain in GAINS)
    late, strong = (
        min(float(alone.square(each, suspect.steps, every=True)[0]) for each in tried)
        for tried in (later, stronger)
    )
    usual = limits.outstanding_error * float(np.median(suspect.before[~suspect.runs]))
    return late < usual or strong < limits.clock_error_ratio * float(suspect.after[run])


def _fault(trials: Trials, best: _Suspect, alike: Sequence[_Suspect]) -> LogFault:
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


def _sentence(trials: Trials, best: _Suspect, alike: Sequence[_Suspect]) -> str:
    """Return observation, correction with its effect on the error, and the next step."""
    logs, question = trials.logs, best.question
    channels, problem, runs = question.channels, question.problem, np.flatnonzero(best.runs)
    of = "" if best.everywhere else f" of {_listed([logs.ids[i] for i in runs])}"
    found = f"{_listed(channels)}{of} {'look' if len(channels) > 1 else 'looks'} {problem.looks}"
    old, new = (np.sqrt(square[best.runs].mean()) for square in (best.before, best.after))
    falls = f"the known model's error falls from {old:.2g} to {new:.2g} standard deviations within a run"
    said = f"{found}: {problem.done}, {falls}."
    if alike:
        others = (f"{_listed(s.question.channels)} ({s.question.problem.name})" for s in alike)
        said += f" These logs cannot distinguish it from {' or '.join(others)}."
    return f"{said} {problem.cure}, then diagnose again."


def _listed(names: Sequence[str]) -> str:
    return " and ".join(filter(None, [", ".join(names[:-1]), names[-1]]))
