"""Channels that freeze: the same number again and again, while the machine moves on."""

from __future__ import annotations

from collections import Counter
from collections.abc import Container, Iterator, Sequence
from itertools import pairwise

import numpy as np

from unmodelled.base.arrays import Array, Mask
from unmodelled.logs.clock import SHORTEST_LOG
from unmodelled.logs.differentiate import noise, quantum
from unmodelled.logs.inspection.signal import Finding, Run, Signal

KIND = "frozen"
#: Fewest equal samples of a frozen stretch.
FEWEST = 10
#: Jump at the end of a stretch, in largest steps around and in counts: a position that stood still starts
#: slowly; in the range of the channel; and of a command, in its largest step elsewhere.
JUMP, LEAST, JUMP_INPUT = 4.0, 0.05, 2.0
#: Smallest noise of a channel that never repeats a value, in its range, and largest share of repeated values
#: outside of the stretches.
NOISY, REPEATED = 1e-5, 0.01
#: Second differences before a stretch, in those of white noise: noise is there, and hides the motion.
ROUGH = 0.3, 4.0
#: Median size of the second difference of white noise, in its standard deviation.
SECOND = 0.6745 * 6.0**0.5
#: Step before a held command, in its median step: one that pauses on purpose comes to a stop before.
MOVING = 0.2
#: Smallest share of the samples that must remain in parts of 50 samples or more.
REMAIN = 0.5


def frozen(runs: Sequence[Run]) -> tuple[list[Run], list[Finding]]:
    """Leave out the samples in which a channel is frozen, so that runs are cut there.

    A position is frozen where it stands still and then jumps to where the machine is. A channel with noise is
    frozen where one number repeats. A machine at rest, an encoder of low resolution, a saturated command and
    an input in steps are not.
    """
    found, left_out = list[Finding](), [np.zeros(len(run.t), np.bool_) for run in runs]
    for signal in runs[0].signals:
        levels = _levels(runs, signal)
        stretches = [
            [s for s in stretches_of(run.values[signal.column]) if _is_frozen(run, signal, s, levels)]
            for run in runs
        ]
        rows = [_rows(run, own) for run, own in zip(runs, stretches, strict=True)]
        enough = all(enough_without(old | new) for old, new in zip(left_out, rows, strict=True))
        if enough:
            left_out = [old | new for old, new in zip(left_out, rows, strict=True)]
        for run, own in zip(runs, stretches, strict=True):
            if not own:
                continue
            first = float(run.t[own[0][0]] - run.t[0])
            longest = max(float(run.t[end - 1] - run.t[start]) for start, end in own)
            what = f"freezes {{count}} times, for up to {longest:.3g} s,"
            cure = "the run was cut there" if enough else "too little remains without; repair the recording"
            found.append(Finding(KIND, signal.name, run.name, len(own), first, what, cure, enough))
    return [run.without(rows) if rows.any() else run for run, rows in zip(runs, left_out, strict=True)], found


def _levels(runs: Sequence[Run], signal: Signal) -> set[float]:
    """Return the values at which a channel stands more than once in all runs: commanded, or its ends."""
    values = [run.values[signal.column] for run in runs]
    held = Counter(float(part[start]) for part in values for start, _ in stretches_of(part))
    return {value for value, count in held.items() if count > 1}


def _rows(run: Run, stretches: Sequence[tuple[int, int]]) -> Mask:
    """Return the mask (samples,) of stretches."""
    rows = np.zeros(len(run.t), np.bool_)
    for start, end in stretches:
        rows[start:end] = True
    return rows


def stretches_of(values: Array) -> Iterator[tuple[int, int]]:
    """Yield first samples of equal ones, and the samples after the last, of values (samples,)."""
    edges = np.flatnonzero(np.concatenate([[True], np.diff(values) != 0.0, [True]]))
    for start, end in pairwise(edges.tolist()):
        if end - start >= FEWEST:
            yield start, end


def _is_frozen(run: Run, signal: Signal, stretch: tuple[int, int], levels: Container[float]) -> bool:
    values, (start, end) = run.values[signal.column], stretch
    value = float(values[start])
    if signal.held or (signal.role == "input" and value in levels):
        return False
    others = [run.values[s.column][start:end] for s in run.signals if s.column != signal.column]
    if start == 0 or not any(np.ptp(other) > 0.0 for other in others):
        return False
    span = run.spans[signal.column]
    if signal.role == "position" and _catches_up(values, stretch, span):
        return True
    # an end of the range is reached again and again, by noise alone
    once = end == len(values) and value not in levels and np.count_nonzero(values == value) == end - start
    if value == 0.0 or (value in (float(values.min()), float(values.max())) and not once):
        return False
    return _noisy(values, stretch) or (signal.role == "input" and _paused(values, stretch, span))


def _catches_up(values: Array, stretch: tuple[int, int], span: float) -> bool:
    """Return whether the channel jumps at the end of a stretch as it does nowhere around."""
    start, end = stretch
    if end + 1 >= len(values):
        return False
    reach = max(FEWEST, end - start)
    around = np.abs(
        np.concatenate([np.diff(values[max(0, start - reach) : start]), np.diff(values[end : end + reach])])
    )
    jump, least = abs(float(values[end] - values[end - 1])), JUMP * quantum(values)
    return jump > max(least, LEAST * span) and jump > JUMP * float(around.max(initial=0.0)) > 0.0


def _noisy(values: Array, stretch: tuple[int, int]) -> bool:
    """Return whether a channel has noise, up to a stretch too, and no steps of a converter.

    It repeats no value then. What a filter lets settle has lost its noise before.
    """
    same, rough = np.diff(values) == 0.0, np.abs(np.diff(values, 2))
    free = np.ones(len(values), np.bool_)
    for start, end in stretches_of(values):
        same[start : end - 1] = False
        free[start + 1 : end] = False
    moving = values[free]  # a stretch to the end can be most of a run
    if len(moving) < FEWEST or quantum(moving) > 0.0 or noise(moving) < NOISY * float(np.ptp(values)):
        return False
    before = rough[max(0, stretch[0] - FEWEST - 2) : max(0, stretch[0] - 2)]
    if float(same.mean()) >= REPEATED or not len(before):
        return False
    low, high = ROUGH
    return low < float(np.median(before)) / (SECOND * noise(moving)) < high


def _paused(values: Array, stretch: tuple[int, int], span: float) -> bool:
    """Return whether a smooth command is held in the middle of its motion, and jumps on afterwards.

    A level that is commanded is reached by a step, and the value at which a logger stops is not.
    """
    start, end = stretch
    if end >= len(values) or start < 2:
        return False
    change: Array = np.abs(np.diff(values))
    free = np.ones(len(change), np.bool_)
    for first, last in stretches_of(values):
        free[[max(0, first - 1), min(last, len(values) - 1) - 1]] = False
    usual = change[free & (change > 0.0)]
    if not len(usual) or change[end - 1] < max(JUMP_INPUT * float(usual.max()), LEAST * span):
        return False
    return bool(MOVING * float(np.median(usual)) < change[start - 1] <= float(usual.max()))


def enough_without(left_out: Mask) -> bool:
    """Return whether parts of 50 samples or more, without some (samples,), hold at least half of all."""
    edges = np.flatnonzero(np.diff(np.concatenate([[True], left_out, [True]]).astype(np.int8)))
    lengths = edges[1::2] - edges[::2]
    return bool(lengths[lengths >= SHORTEST_LOG].sum() >= REMAIN * len(left_out))
