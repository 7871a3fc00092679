"""Faults of logs of which the size is fitted: an offset of one experiment, a clock that runs fast or slow,
a factor of a channel."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from scipy.optimize import linear_sum_assignment, minimize_scalar

from unmodelled.base.arrays import Array, Indices, Mask
from unmodelled.diagnosis.faults.corrected_logs import Correction
from unmodelled.diagnosis.faults.questions import (
    TIME_CHANNEL,
    LogProblem,
    Question,
    groups,
    multiplied,
)
from unmodelled.diagnosis.faults.replaced_columns import other_run, with_other_runs
from unmodelled.diagnosis.faults.trials import EQUAL_ERROR_RATIO, OUTSTANDING_ERROR, Trials
from unmodelled.logs.inspection.pairs import FACTOR

#: Name of the problem.
CLOCK_PROBLEM = "clock"
#: Factors by which the known inertia, or a number of the file, may be wrong; beyond them a wrong clock, or
#: another unit, is more likely.
WRONG = 0.5, 2.0
#: Offsets around the difference of the means that are tried, in standard deviations within a run.
OFFSETS = np.linspace(-3.0, 3.0, 13)
#: Largest number of runs whose inputs are tried in each other.
MOST_RUNS = 40
#: Turn of a shaft, rad.
TURN = 2.0 * np.pi
#: Logarithms of the factors of time that are tried: from 0.47 to 2.1.
FACTORS = np.linspace(-0.75, 0.75, 7)
#: Logarithms of the factors of channels that are tried: from 0.01 to 100.
GAINS = np.log(10.0) * np.linspace(-2.0, 2.0, 13)
#: Largest number of evaluations of the refinement, and its tolerance in distances of those values.
REFINEMENT_EVALUATIONS, REFINEMENT_TOLERANCE = 15, 1e-4
#: A wrong clock is written in per cent up to this deviation, beyond it as a factor.
PER_CENT = 0.2


def of_every(trials: Trials, steps: int) -> Question:
    """Fit the clock of all experiments."""
    return clock_of(trials, _factor(trials, steps), np.ones(len(trials.logs), np.bool_))


def of_some(trials: Trials, steps: int, before: Array) -> Iterator[Question]:
    """Fit an offset, the clock and factors of channels to an experiment that stands out.

    Its error is the largest of `before` (experiments,). The offset is that of this experiment alone; clock
    and factors may be those of others, too, so that they are asked of this one and of all.
    """
    worst = int(np.argmax(before))
    others = np.arange(len(before)) != worst
    # of two experiments, nothing tells which one is wrong
    if others.sum() < 2 or before[worst] < OUTSTANDING_ERROR * np.median(before[others]):
        return
    alone = trials.among([worst])
    if (moved := _offset(trials, alone, steps, worst)) is not None:
        yield moved
    clock = _factor(alone, steps)
    yield clock_of(trials, clock, ~others)
    yield clock_of(trials, clock, np.ones_like(others))
    for name in (*trials.logs.outputs, *trials.logs.inputs):
        factor = _gain(alone, steps, (name,))
        if abs(np.log(factor)) > np.log(FACTOR):  # no gain of a sensor
            yield multiplied(trials.logs, (name,), factor)


def factors_of(trials: Trials, steps: int, some: Mask) -> Iterator[Question]:
    """Fit the factor of channels that may share one to some runs (experiments,); ask it of all.

    The factor of an input acts as its inverse on all outputs of a linear machine: all are asked alike.
    """
    runs = np.flatnonzero(some).tolist()
    for channels in groups(trials.system) if runs else ():
        factor = _gain(trials.among(runs), steps, channels)
        if not WRONG[0] <= factor <= WRONG[1]:
            yield multiplied(trials.logs, channels, factor)


def swapped(trials: Trials, steps: int, before: Array) -> Iterator[Question]:
    """Yield whether files were exchanged: columns of others leave far less than `before` (experiments,).

    Every file belongs to one run, so that inputs, or an output, of others fit in a circle of runs, or none
    were exchanged: a drive that follows its command late may fit that of some other run better, too.
    """
    logs, many = trials.logs, len(trials.logs)
    columns = [*([None] if logs.inputs else []), *range(len(logs.outputs) if len(logs.outputs) > 1 else 0)]
    runs = np.arange(many)
    for output in columns if 1 < many <= MOST_RUNS else ():
        moved = (with_other_runs(logs, np.full(many, k), output) for k in range(many))
        each = np.array([trials.square(correction, steps) for correction in moved])
        # errors of runs with the columns of others, in those with their own
        share = each[(runs - runs[:, None]) % many, runs[:, None]] / np.maximum(before[:, None], 1e-300)
        shifts = (owners(share, 1.0 - trials.options.fault_share) - runs) % many
        if shifts.any():
            yield other_run(logs, shifts, output)


def owners(share: Array, most: float) -> Indices:
    """Return the run (runs,) whose inputs every run has, of errors (runs, runs) with those of others.

    Exchanged are circles of runs of which each leaves less than `most` of the error with its own inputs.
    """
    own = np.arange(len(share))
    owner = np.asarray(linear_sum_assignment(np.nan_to_num(share, nan=np.finfo(float).max))[1])
    better = share[own, owner] < most
    while (circle := better & better[owner]).sum() < better.sum():
        better = circle
    return np.where(better, owner, own)


def _factor(trials: Trials, steps: int) -> float:
    """Return the factor of the time of all experiments with the smallest error."""
    every = np.ones(len(trials.logs))

    def square(logarithm: float) -> float:
        correction = replace(trials.none, clock=np.exp(logarithm) * every)
        return float(trials.square(correction, steps).sum())

    return float(np.exp(_lowest(square, FACTORS)[0]))


def _gain(trials: Trials, steps: int, channels: tuple[str, ...]) -> float:
    """Return the factor of channels of all experiments with the smallest error."""

    def square(logarithm: float) -> float:
        question = multiplied(trials.logs, channels, float(np.exp(logarithm)))
        return float(trials.square(question.correction, steps).sum())

    return float(np.exp(_lowest(square, GAINS)[0]))


def clock_of(trials: Trials, factor: float, runs: Mask) -> Question:
    """Return the question whether the time of some experiments (experiments,) is wrong by a factor."""
    fast = 1.0 / factor
    way = "fast" if fast > 1.0 else "slow"
    times = f"{100.0 * abs(fast - 1.0):.2g} %"
    if abs(fast - 1.0) > PER_CENT:
        times = f"{max(fast, factor):.3g} times too"
    problem = LogProblem(
        *(CLOCK_PROBLEM, factor, "", f"as if its clock ran {times} {way}", f"multiplied by {factor:.5g}"),
        "Check the sampling rate of the logger",
    )
    return Question(problem, (TIME_CHANNEL,), replace(trials.none, clock=np.where(runs, factor, 1.0)))


def _offset(trials: Trials, alone: Trials, steps: int, run: int) -> Question | None:
    """Return the question of the best offset of one output of an experiment.

    It is None if the offset is smaller than the standard deviation of the output within the experiment. Whole
    turns of a shaft that turns in other experiments are none, where the model is the same a turn later.
    """
    logs, others = trials.logs, np.arange(len(trials.logs)) != run
    means = np.array([logs.y[logs.rows(i)].mean(axis=0) for i in range(len(logs))])
    centre = np.median(means[others], axis=0) - means[run]
    size = np.maximum(trials.deviations[run], np.median(trials.deviations, axis=0))

    def square(j: int) -> Callable[[float], float]:
        return lambda by: float(alone.square(_shifted(alone, 0, j, by), steps)[0])

    found = [_lowest(square(j), centre[j] + OFFSETS * size[j]) for j in range(len(logs.outputs))]
    j = int(np.argmin([lowest for _, lowest in found]))
    by, lowest = found[j]
    elsewhere = np.delete(logs.y[:, j], logs.rows(run))
    if trials.system.outputs[j].unit == "rad" and abs(by) <= np.ptp(elsewhere):
        rest = float(np.remainder(by + np.pi, TURN) - np.pi)
        by = rest if square(j)(rest) <= EQUAL_ERROR_RATIO * lowest else by
    if abs(by) < trials.deviations[run, j]:
        return None
    shift = f"{-by:.6g} {trials.system.outputs[j].unit}"
    cure = "Subtract the offset from the column"
    problem = LogProblem("offset", 1.0, "", f"shifted by {shift}", f"less {shift}", cure)
    return Question(problem, (logs.outputs[j],), _shifted(trials, run, j, by))


def _shifted(trials: Trials, run: int, j: int, by: float) -> Correction:
    shift = np.zeros_like(trials.none.offset)
    shift[run, j] = by
    return replace(trials.none, offset=shift)


def _lowest(square: Callable[[float], float], tried: Array) -> tuple[float, float]:
    """Return the argument with the smallest value, near the best of evenly spaced ones, and that value."""
    squares = [square(float(each)) for each in tried]
    k, step = int(np.argmin(squares)), float(tried[1] - tried[0])
    best = minimize_scalar(
        square,
        bounds=(tried[k] - step, tried[k] + step),
        method="bounded",
        options={"maxiter": REFINEMENT_EVALUATIONS, "xatol": REFINEMENT_TOLERANCE * step},
    )
    return min((float(best.x), float(best.fun)), (float(tried[k]), squares[k]), key=lambda each: each[1])
