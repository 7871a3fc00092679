"""Channels that freeze: the same number again and again, while the machine moves on."""

from __future__ import annotations

from collections.abc import Iterator
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


def frozen(run: Run) -> tuple[Run, list[Finding]]:
    """Leave out the samples in which a channel is frozen, so that the run is cut there.

    A position is frozen where it stands still and then jumps to where the machine is. A channel with noise is
    frozen where one number repeats. A machine at rest, an encoder of low resolution, a saturated command and
    a command in steps are not.
    """
    found, left_out = list[Finding](), np.zeros(len(run.t), np.bool_)
    for signal in run.signals:
        stretches = [s for s in _stretches(run.values[signal.column]) if _is_frozen(run, signal, s)]
        if not stretches:
            continue
        rows = np.zeros(len(run.t), np.bool_)
        for start, end in stretches:
            rows[start:end] = True
        enough = _enough(left_out | rows)
        if enough:
            left_out |= rows
        first = float(run.t[stretches[0][0]] - run.t[0])
        longest = max(float(run.t[end - 1] - run.t[start]) for start, end in stretches)
        what = f"freezes {{count}} times, for up to {longest:.3g} s,"
        cure = "the run was cut there" if enough else "too little remains without it; repair the recording"
        found.append(Finding(KIND, signal.name, run.name, len(stretches), first, what, cure, enough))
    return (run.without(left_out) if left_out.any() else run), found


def _stretches(values: Array) -> Iterator[tuple[int, int]]:
    """Yield first samples of equal ones, and the samples after the last."""
    edges = np.flatnonzero(np.concatenate([[True], np.diff(values) != 0.0, [True]]))
    for start, end in pairwise(edges.tolist()):
        if end - start >= FEWEST:
            yield start, end


def _is_frozen(run: Run, signal: Signal, stretch: tuple[int, int]) -> bool:
    values, (start, end) = run.values[signal.column], stretch
    value = float(values[start])
    others = [run.values[s.column][start:end] for s in run.signals if s.column != signal.column]
    if start == 0 or not any(np.ptp(other) > 0.0 for other in others):
        return False
    span = run.spans[signal.column]
    if signal.role == "position" and _catches_up(values, stretch, span):
        return True
    extreme = value in (float(values.min()), float(values.max()), 0.0)
    if extreme:
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
    if quantum(values) > 0.0 or noise(values) < NOISY * float(np.ptp(values)):
        return False
    same, rough = np.diff(values) == 0.0, np.abs(np.diff(values, 2))
    for start, end in _stretches(values):
        same[start : end - 1] = False
    before = rough[max(0, stretch[0] - FEWEST - 2) : max(0, stretch[0] - 2)]
    if float(same.mean()) >= REPEATED or not len(before):
        return False
    low, high = ROUGH
    return low < float(np.median(before)) / (SECOND * noise(values)) < high


def _paused(values: Array, stretch: tuple[int, int], span: float) -> bool:
    """Return whether a smooth command is held in the middle of its motion, and jumps on afterwards."""
    start, end = stretch
    if end >= len(values) or start < 2:
        return False
    change: Array = np.abs(np.diff(values))
    jump, free = change[end - 1], np.ones(len(change), np.bool_)
    free[[last - 1 for _, last in _stretches(values) if last < len(values)]] = False
    usual = change[free & (change > 0.0)]
    if not len(usual) or jump < max(JUMP_INPUT * float(usual.max()), LEAST * span):
        return False
    return bool(change[start - 1] > MOVING * float(np.median(usual)))


def _enough(left_out: Mask) -> bool:
    """Return whether parts of 50 samples or more hold at least half of all samples."""
    edges = np.flatnonzero(np.diff(np.concatenate([[True], left_out, [True]]).astype(np.int8)))
    lengths = edges[1::2] - edges[::2]
    return bool(lengths[lengths >= SHORTEST_LOG].sum() >= REMAIN * len(left_out))
