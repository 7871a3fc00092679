"""Faults of logs that explain the gap: units, signs, offsets, clocks, copies.

All questions are answered by one principle: the known physics, quickly re-identified, runs free under the
corrected logs. A fault explains the share by which the mean square error falls.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain

import numpy as np

from unmodelled.base.arrays import Array, Mask
from unmodelled.diagnosis.data.gap import steps_of
from unmodelled.diagnosis.data.options import DEFAULT_OPTIONS, Options
from unmodelled.diagnosis.data.persistence import default_horizon
from unmodelled.diagnosis.data.result import LogFault
from unmodelled.diagnosis.data.sensors import Sensors
from unmodelled.diagnosis.faults.copies import clipped_notes, command_notes, copies, notes, register_notes
from unmodelled.diagnosis.faults.corrected_logs import Correction
from unmodelled.diagnosis.faults.duplicates import copied_columns, different, duplicates
from unmodelled.diagnosis.faults.fits import clock_of, factors_of, of_every, of_some, swapped
from unmodelled.diagnosis.faults.inputs import NOT_RECORDED, unknown_inputs
from unmodelled.diagnosis.faults.questions import (
    FACTOR_PROBLEM,
    GIVEN,
    Question,
    clocks,
    constants,
    exchanged,
    moves_with_constant_inputs,
    moves_without_input,
    multiples_of_slopes,
    multiplied,
    questions,
    unchanged_inputs,
    without_input,
    without_inputs,
)
from unmodelled.diagnosis.faults.rates import Ratio, rate_faults, ratios
from unmodelled.diagnosis.faults.replaced_columns import signed_steps, slow_inputs
from unmodelled.diagnosis.faults.suspects import Suspect, explained_by_law
from unmodelled.diagnosis.faults.trials import EQUAL_ERROR_RATIO, QUESTION_SAMPLES, SUSPECT_SHARE, Trials
from unmodelled.diagnosis.faults.verdict import best_of, fault_of, identified, is_good, only, where
from unmodelled.logs.inspection.pairs import commands_as_outputs
from unmodelled.logs.inspection.related import is_related, surrogates
from unmodelled.logs.logs import Logs
from unmodelled.logs.preparation import prepare
from unmodelled.systems.model import System

#: Error, in that of persistence, below which no fault matters.
NEGLIGIBLE_ERROR = 0.01
#: Horizons that are tried one after the other, in units of the given one: within a short horizon a true model
#: may be hardly better than no model.
HORIZON_FACTORS = 1.0, 4.0
#: Normal quantile of a one-sided test at 5 %.
ONE_SIDED = 1.645
#: Horizons up to which an input acts.
MEMORY = 2
#: Corrections that are re-identified, the most promising ones (a budget).
REIDENTIFIED = 3
#: Squared error, in that of persistence, from which the known physics is of no use: units and inputs may be
#: far off. With steps that are a thousand times too short, it is a prediction that keeps the speed.
USELESS = 0.5


def without_copies(
    system: System, logs: Logs, horizon: float, options: Options = DEFAULT_OPTIONS
) -> tuple[System, Logs, tuple[LogFault, ...]]:
    """Return system and logs without computed outputs; and all faults.

    Such an output, for example a speed that a drive has differenced and smoothed, is no second sensor: what
    it shows beyond the output that it is computed from is its filter.
    """
    found = copies(different(logs))
    commands = commands_as_outputs(system, logs.y, logs.u, logs.offsets)
    alone = len(commands) == len(logs.outputs)
    said = (*register_notes(system, logs), *clipped_notes(system, logs))
    said = (*said, *notes(logs, found), *command_notes(logs, commands, alone))
    if any(fault.decides for fault in said):
        return system, logs, said
    if found or commands:
        kept = sorted({*range(len(logs.outputs))} - {copy.target for copy in found} - {*commands})
        system = replace(system, outputs=tuple(system.outputs[k] for k in kept))
        shown = tuple(logs.outputs[k] for k in kept)
        logs = prepare(system, replace(logs, outputs=shown, y=logs.y[:, kept]))
    return system, logs, (*said, *log_faults(system, logs, horizon, options))


def log_faults(
    system: System, logs: Logs, horizon: float, options: Options = DEFAULT_OPTIONS
) -> tuple[LogFault, ...]:
    """Find faults of the logs, and the fault that explains most of the gap if there is one."""
    found = different(logs)
    contradictions = tuple(_contradictions(system, found, horizon, options))
    if any(fault.decides for fault in contradictions):
        return *duplicates(logs), *contradictions
    answer = _answer(system, found, horizon, options)
    said = [
        note
        for note in constants(found)
        if not answer or (note.problem, note.channels) != (answer[0].problem, answer[0].channels)
    ]
    undriven = moves_without_input(found)
    blind = not answer or answer[0].problem == NOT_RECORDED
    if blind and undriven.any() and _far_off(system, found, horizon, options, undriven):
        answer = ()  # what the samples show is surer
        said = [replace(note, decides=True) for note in said] or [without_input(found, undriven)]
    if not answer and not any(note.decides for note in said):
        answer = _unrelated(system, found, horizon, options)
    if not any(each.decides for each in (*said, *answer)):
        said += _unchanged(system, found, options)
    return *duplicates(logs), *contradictions, *said, *answer


def _unchanged(system: System, logs: Logs, options: Options) -> Iterator[LogFault]:
    """Yield the fault that runs with constant inputs look driven, if half of such a run is no free motion."""
    runs = moves_with_constant_inputs(logs)
    half = 0.5 * logs.period * float(np.diff(logs.offsets).min())
    if runs.any() and _far_off(system, logs, half, options, runs):
        yield unchanged_inputs(logs, runs)


def _contradictions(system: System, logs: Logs, horizon: float, options: Options) -> Iterator[LogFault]:
    """Yield faults that the samples show beyond doubt, whatever the model says."""
    trials = Trials(system, logs, horizon, Sensors(logs), options)
    faults = tuple(rate_faults(system, logs, trials.sensors)) or tuple(copied_columns(logs))
    yield from faults or (_of_ratio(trials, ratio) for ratio in ratios(system, logs, trials.sensors))
    for speed, position, factor in () if faults else multiples_of_slopes(system, logs):
        every = np.ones(len(logs), np.bool_)
        yield _of_contradiction(trials, (speed, position, clock_of(trials, 1.0 / factor, every)), every)


def _of_ratio(trials: Trials, ratio: Ratio) -> LogFault:
    """Return which of clock, position and speed makes a speed another multiple of the slope in some runs.

    Each would explain it, so that the one with the smallest error of the known physics is the answer.
    """
    logs, rate, factor = trials.logs, ratio.rate, ratio.factor
    position, speed = logs.outputs[rate.position], logs.outputs[rate.speed]
    asked = (
        clock_of(trials, 1.0 / factor, ratio.runs),
        multiplied(logs, (speed,), 1.0 / factor),
        multiplied(logs, (position,), factor),
    )
    return _of_contradiction(trials, asked, ratio.runs)


def _of_contradiction(trials: Trials, asked: Sequence[Question], runs: Mask) -> LogFault:
    """Return the one of some corrections, each of which makes samples agree, that suits the model best.

    The samples contradict each other: the error of the model only tells which column is wrong.
    """
    steps, nothing = trials.steps(trials.none), np.zeros(len(trials.logs))
    tried = [identified(trials, only(question, runs, steps, nothing, nothing)) for question in asked]
    best, *alike = best_of(trials, tried)
    return replace(fault_of(trials, best, alike), explains=None)


def _unrelated(system: System, logs: Logs, horizon: float, options: Options) -> tuple[LogFault, ...]:
    """Return the fault that the inputs have nothing to do with the outputs, as a tuple of one, or none.

    The model is worse with these inputs than without any, and as good with random signals of their spectrum;
    and without a model, these signals predict the outputs as well.
    """
    if not logs.inputs:
        return ()
    trials = Trials(system, logs, horizon, Sensors(logs), options)
    question, steps = without_inputs(logs), trials.steps(trials.none)
    before, after = (trials.square(c, steps) for c in (trials.none, question.correction))
    suspect = Suspect(question, np.ones(len(logs), np.bool_), steps, before, after)
    if not suspect.explains > SUSPECT_SHARE or is_related(logs, MEMORY * steps):
        return ()
    random = np.array([trials.square(Correction.replaced(logs, u), steps) for u in surrogates(logs)])
    # of inputs that have nothing to do with them, the mean rank of the errors is one of uniform numbers
    rank, usual = (before < random).mean(), 0.5 + ONE_SIDED / np.sqrt(12.0 * len(logs))
    if rank > usual or explained_by_law(trials, identified(trials, suspect)):
        return ()
    return (fault_of(trials, suspect, ()),)


def _far_off(system: System, logs: Logs, horizon: float, options: Options, runs: Mask) -> bool:
    """Return whether the known physics, refitted, is hardly better than no model in runs (experiments,)."""
    trials = Trials(system, logs, horizon, Sensors(logs), options)
    steps = trials.steps(trials.none)
    left, nothing = trials.identified(trials.none, steps), trials.persistence(steps)
    return float(left[runs].sum()) > (1.0 - options.fault_share) * float(nothing[runs].sum())


def _answer(system: System, logs: Logs, horizon: float, options: Options) -> tuple[LogFault, ...]:
    """Return the fault that explains the gap, as a tuple of one, or none."""
    sensors = Sensors(logs)
    for longer in HORIZON_FACTORS:
        trials = Trials(system, logs, longer * horizon, sensors, options)
        steps = trials.steps(trials.none)
        before, nothing = trials.square(trials.none, steps), trials.persistence(steps)
        if not _matters(before, nothing):
            continue
        fits = _fits(trials, steps, before, nothing) if longer == 1.0 else ()
        suspects = [*_suspects(trials, steps, before, nothing), *fits]
        few = sorted(_plainest(suspects), key=lambda s: -s.explains)[:REIDENTIFIED]
        tried = (identified(trials, s) for s in suspects if s in few)
        unknown = unknown_inputs(trials, steps)
        right = [s for s in chain(tried, unknown) if s.is_enough(options) and is_good(trials, s)]
        if right:
            best, *others = best_of(trials, right)
            alike = [s for s in others if s.question.channels != best.question.channels]
            return (fault_of(trials, best, alike),)
    return ()


def _plainest(suspects: Sequence[Suspect]) -> Iterator[Suspect]:
    """Yield one suspect for the same problem or for given factors of the same channels in the same runs.

    It is the first one with almost their smallest error: a thousandth and a millionth of an input are alike.
    """
    alike: dict[tuple[tuple[str, ...], bytes, str], list[Suspect]] = {}
    for suspect in suspects:
        problem = suspect.question.problem
        name = "" if problem.name in GIVEN else problem.name
        alike.setdefault((suspect.question.channels, suspect.runs.tobytes(), name), []).append(suspect)
    for each in alike.values():
        least = min(float(s.after.sum()) for s in each)
        yield next(s for s in each if float(s.after.sum()) <= EQUAL_ERROR_RATIO * least)


def _suspects(trials: Trials, steps: int, before: Array, nothing: Array) -> Iterator[Suspect]:
    """Yield corrections by given factors; errors of logs as read and of persistence are (experiments,)."""
    logs, useless = trials.logs, before > USELESS * nothing
    asked = questions(trials.system, logs, before.sum() > USELESS * nothing.sum())
    shaped = (*exchanged(logs), *signed_steps(trials.system, logs))
    for question in (*asked, *shaped, *factors_of(trials, steps, useless)):
        after = trials.square(question.correction, steps)
        for runs in where(before, after, trials.options):
            suspect = only(question, runs, steps, before, after)
            gain = question.problem.name == FACTOR_PROBLEM and suspect.everywhere  # an effect, no fault
            if suspect.explains > SUSPECT_SHARE and not gain:
                yield suspect
    for question in (*slow_inputs(logs), *(swapped(trials, steps, before) if useless.any() else ())):
        after = trials.square(question.correction, steps)
        yield only(question, question.correction.corrected, steps, before, after)
    # a right clock, a thousand times faster, would make one window of every experiment; the number of
    # samples of the default horizon does not depend on the clock
    most = max(1, min(steps_of(default_horizon(logs, trials.sensors), logs), QUESTION_SAMPLES // len(logs)))
    for question in clocks(trials.system, logs):
        fast = question.problem.factor < 1.0
        if before.sum() <= (1.0 if fast else USELESS) * nothing.sum():
            continue  # its clock cannot be a thousand times off
        steps = min(trials.steps(question.correction), most) if fast else most
        old, new = (trials.square(c, steps) for c in (trials.none, question.correction))
        yield Suspect(question, np.ones(len(logs), np.bool_), steps, old, new)


def _fits(trials: Trials, steps: int, before: Array, nothing: Array) -> Iterator[Suspect]:
    """Yield corrections with a fitted size; over a long horizon they also fit errors of other causes.

    One experiment stands out once the uncertain parameters are fitted to all: before, wrong numbers leave
    errors everywhere.
    """
    known = trials.refitted(steps)
    left = known.square(known.none, steps, every=True)
    some = of_some(known, steps, left) if _matters(left, nothing) else ()
    every = (trials, before, of_every(trials, steps), False)
    found = set[tuple[str, str, bytes]]()
    for tried, old, question, whole in (every, *((known, left, q, True) for q in some)):
        after, mine = tried.square(question.correction, steps, whole), question.correction.corrected
        for runs in where(old, after, trials.options) if whole and mine.all() else (mine,):
            suspect = only(question, runs, steps, old, after)
            own = question.problem.name, question.channels[0], runs.tobytes()
            if suspect.explains > SUSPECT_SHARE and not (whole and runs.all()):
                if own not in found:
                    yield suspect
                found.add(own)


def _matters(square: Array, nothing: Array) -> bool:
    """Return whether the error of an experiment matters beside that of persistence in all."""
    return float(square.max()) >= NEGLIGIBLE_ERROR**2 * float(np.median(nothing))
