"""Spikes of up to three samples: garbage numbers and dropouts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from unmodelled.base.arrays import Array, Mask
from unmodelled.logs.clock import Kind, read_at
from unmodelled.logs.inspection.signal import REACH, Course, Finding, Run, Signal

KIND = "spikes"
#: Height of a spike, in largest steps around it: a position cannot go there and back within three samples,
#: and where it bounces, its steps are as large before and after. Other channels can be quick, so that their
#: spikes must be garbage far beyond all other samples. Zeros, and spikes of a state, stand off a smooth
#: course, in errors of reading a sample between its neighbours.
HEIGHT, HEIGHT_GARBAGE, HEIGHT_ZEROS = 5.0, 30.0, 10.0
#: Smallest height of a spike, in the range of the channel: smaller ones are the count of an encoder.
LEAST = 0.05
#: Fewest zeros of a channel that drops out, and longest spike, samples.
FEWEST_ZEROS, LONGEST = 3, 3
#: Distance of garbage from the values of the run, in their range: for states, and for outputs that an impact
#: makes large and inputs.
FAR, FAR_OTHERS = 1.0, 20.0
#: Largest share of spikes among the samples; more are a course of their own, as that of a modulated input.
MOST = 0.1
#: Samples around the jump of an input at which a state may be quick.
MARGIN = 5
#: Turn of a shaft, rad: a wrapped angle that trembles at the end of its turn has no spikes.
TURN = 2.0 * np.pi


def spikes(runs: Sequence[Run]) -> tuple[list[Run], list[Finding]]:
    """Replace spikes by the course of the samples around them, of a channel in all runs or in none."""
    found, runs = list[Finding](), list(runs)
    for signal in runs[0].signals:
        masks = [_spikes(run, signal) for run in runs]
        many = [_too_many(run, signal, bad) for run, bad in zip(runs, masks, strict=True)]
        if not any(bad.any() and bad.mean() <= MOST for bad in masks):
            continue  # none, or so many that they are a course of their own
        for k, (run, bad) in enumerate(zip(runs, masks, strict=True)):
            if bad.any():
                found.append(_finding(run, signal, bad, not any(many)))
                runs[k] = run if any(many) else _without(run, signal, bad)
    return runs, found


def _finding(run: Run, signal: Signal, bad: Mask, cured: bool) -> Finding:
    zeros = bool((run.values[signal.column][bad] == 0.0).all())
    first = float(run.t[np.argmax(bad)] - run.t[0])
    what = "falls to 0 in {count} samples" if zeros else "has {count} spikes of up to three samples"
    cure = "they were left out and read between their neighbours; check the sensor's cable or bus"
    if not cured:
        cure = "a run has too many, so that nothing was changed; leave that run out, or repair the sensor"
    return Finding(KIND, signal.name, run.name, int(bad.sum()), first, what, cure, cured)


def _without(run: Run, signal: Signal, bad: Mask) -> Run:
    values = run.values[signal.column].copy()
    kind: Kind = "linear" if signal.role == "input" else "cubic"
    values[bad] = read_at(run.t[~bad], values[~bad], run.t[bad], kind)
    return run.with_values(signal, values)


def _too_many(run: Run, signal: Signal, bad: Mask) -> bool:
    """Return whether spikes, or zeros beside them, are so many that their neighbours show no course."""
    values = run.values[signal.column]
    zeros = bool(bad.any() and (values[bad] == 0.0).all())
    return bool(bad.mean() > MOST or (zeros and (_short(values == 0.0) | bad).mean() > MOST))


def _spikes(run: Run, signal: Signal) -> Mask:
    """Return the samples, shape (samples,), of spikes in a channel; more than `MOST` as they stand out."""
    course = run.course(signal)
    height = np.abs(course.values - course.smooth)
    if signal.unit.strip() == "rad":
        height = np.minimum(height, np.abs(height - TURN))
    tall = height > LEAST * run.spans[signal.column]
    far, driven = _far(course, signal), quick_at(run, signal)
    if signal.role == "position":  # of a servo that is logged rarely, quick where its goal jumps
        bad = tall & (height > HEIGHT * course.steps) & (far | ~driven)
    else:
        bad = tall & (height > HEIGHT_GARBAGE * course.steps) & far & ~driven
    if bad.any() and bad.mean() <= MOST:
        bad &= _stands_off(course.values, bad)[0] > HEIGHT
    if signal.role == "state":  # what stores stays: a speed does not go there and back in three samples
        single = _short(tall & (height > HEIGHT * course.steps) & ~driven)
        if single.any() and single.mean() <= MOST:
            bad |= single & (_stands_off(course.values, single)[0] > HEIGHT_ZEROS)
    if signal.role != "other":
        bad |= _dropouts(course.values, LEAST * run.spans[signal.column])
    return bad if np.ptp(course.smooth) > 0.0 else np.zeros_like(bad)


def _far(course: Course, signal: Signal) -> Mask:
    """Return the samples, shape (samples,), that are far beyond all others."""
    low, high = float(course.smooth.min()), float(course.smooth.max())
    far = (FAR if signal.role in ("position", "state") else FAR_OTHERS) * (high - low)
    return np.asarray((course.values < low - far) | (course.values > high + far))


def _dropouts(values: Array, least: float) -> Mask:
    """Return the samples, shape (samples,), that are zero in the middle of a smooth course away from zero.

    An input in steps can be switched off for a sample: where the others stay the same, a zero is none.
    """
    none, zeros = np.zeros(len(values), np.bool_), _short(values == 0.0)
    if not FEWEST_ZEROS <= zeros.sum() <= MOST * len(values):
        return none
    stands_off, moves = _stands_off(values, zeros)
    clear = zeros & moves & (stands_off > HEIGHT_ZEROS)
    if (clear & (np.abs(_read(values, zeros)) > least)).sum() < FEWEST_ZEROS:
        return none
    return np.asarray(clear)


def _read(values: Array, bad: Mask) -> Array:
    """Return all samples, shape (samples,), read between those that are not bad."""
    k = np.arange(len(values), dtype=np.float64)
    return read_at(k[~bad], values[~bad], k, "cubic")


def _stands_off(values: Array, bad: Mask) -> tuple[Array, Mask]:
    """Return how far samples stand off the course of the others, and where the others change.

    The distance, shape (samples,), is in largest errors around of reading one of the others between its
    neighbours: large ones where a motion is fast for its sampling period.
    """
    k, rest = np.arange(len(values)), values[~bad]
    off, change = np.zeros(len(rest)), np.abs(np.gradient(rest))
    off[2:-2] = np.abs(rest[2:-2] - (4.0 * (rest[1:-3] + rest[3:-1]) - rest[:-4] - rest[4:]) / 6.0)
    doubt, moves = (np.interp(k, k[~bad], maximum_filter1d(v, REACH)) for v in (off, change))
    height = np.abs(values - _read(values, bad))
    return height / np.maximum(doubt, 1e-300), moves > 0.0


def _short(mask: Mask) -> Mask:
    """Return a mask without its stretches of more than three samples."""
    long = minimum_filter1d(mask.astype(np.int8), LONGEST + 1, mode="constant")
    return np.asarray(mask & ~maximum_filter1d(long, 2 * LONGEST + 1).astype(np.bool_))


def quick_at(run: Run, signal: Signal) -> Mask:
    """Return the samples, shape (samples,), at which another channel that is an input jumps."""
    driven = np.zeros(len(run.t), np.bool_)
    for other in run.signals:
        if other.role != "input" or other.column == signal.column:
            continue
        change = np.abs(np.diff(run.values[other.column], prepend=run.values[other.column][:1]))
        jumps = change > HEIGHT * max(
            float(np.median(change)), 0.01 * float(np.ptp(run.values[other.column]))
        )
        driven |= maximum_filter1d(jumps.astype(np.float64), MARGIN, mode="nearest") > 0.0
    return driven
