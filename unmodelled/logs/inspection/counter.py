"""Counters that overflow: a channel jumps by the same number of counts again and again."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unmodelled.base.arrays import Array, Indices, Mask
from unmodelled.logs.inspection.signal import Finding, Run, Signal

KIND = "counter"
#: Size of a jump, in largest other steps: a counter moves by far less than its range between two samples.
LARGE = 8.0
#: Fewest jumps of one size where that is no power of two counts.
FEWEST = 3
#: Largest share of jumps among the samples, and longest excursion that is a spike, samples.
MOST, SPIKE = 0.05, 2
#: Powers of two that a counter's range can have, and the deviation from a whole count.
BITS, WHOLE = range(7, 33), 1e-2
#: Deviation of a jump from a power of two, counts, and largest doubt of its size from the motion around it.
COUNTS, DOUBT = 2.0, 0.02
TURN = 2.0 * np.pi


@dataclass(frozen=True)
class _Overflow:
    """Jumps of one size."""

    at: Indices  # (jumps,), first samples after them
    size: float  # in the unit of the channel
    counts: int  # size in counts; 0: not known


def counter(run: Run) -> tuple[Run, list[Finding]]:
    """Remove the jumps of counters that overflow.

    A position cannot jump; another channel is a counter only where its jumps are a power of two counts. The
    jumps start and end at the same places of the counter's range, and the channel goes on as before.
    """
    found = list[Finding]()
    for signal in run.signals:
        values = run.values[signal.column]
        overflow = _overflow(values, signal)
        if overflow is None:
            continue
        turns = np.zeros(len(values))
        turns[overflow.at] = -np.sign(np.diff(values)[overflow.at - 1])
        run = run.with_values(signal, values + overflow.size * np.cumsum(turns))
        first = float(run.t[int(overflow.at[0])] - run.t[0])
        size = f"{overflow.size:.4g} {signal.unit}"
        by = f"{overflow.counts} counts ({size})" if overflow.counts else size
        what = f"jumps by {by} {{count}} times, as a counter that overflows,"
        cure = "the jumps were removed"
        found.append(Finding(KIND, signal.name, run.name, len(overflow.at), first, what, cure))
    return run, found


def _overflow(values: Array, signal: Signal) -> _Overflow | None:
    change = np.diff(values)
    size = np.abs(change)
    jumps = size > 0.5 * size.max()
    rest = float(size[~jumps].max(initial=0.0))
    if not 0 < jumps.sum() <= MOST * len(values) or size.max() < LARGE * rest or rest == 0.0:
        return None
    at = np.flatnonzero(jumps) + 1
    if np.ptp(size[jumps]) > 2.0 * rest or not _goes_on(at):
        return None
    sizes, doubt = _without_motion(at, change)
    middle, unit = float(np.median(sizes)), count_of(values)
    counts = _power(middle / unit, doubt / unit) if unit else 0
    if signal.unit.strip() == "rad" and abs(middle - TURN) < 2.0 * rest:
        return None  # a wrapped angle
    if not counts and (signal.role != "position" or len(at) < FEWEST):
        return None
    modulus = counts * unit if counts else middle
    ends = np.concatenate([values[at], values[at - 1]])
    around = np.remainder(ends - ends[0] + 0.5 * modulus, modulus)
    if np.ptp(around) > 4.0 * rest:
        return None
    return _Overflow(at, modulus, counts)


def _goes_on(at: Indices) -> bool:
    """Return whether a jump is no spike: the channel does not jump back within two samples."""
    back = np.diff(at) <= SPIKE
    lone = np.ones(len(at), np.bool_)
    lone[1:] &= ~back
    lone[:-1] &= ~back
    return bool(lone.any())


def count_of(values: Array) -> float:
    """Return the unit of which all values are whole multiples, apart from a constant; 0 if there is none.

    Takes values (samples,).

    Examples:
        >>> round(count_of(0.25 * np.array([3, 7, 8, 40, 41, 17.0])), 3)
        0.25
    """
    levels = np.unique(values)
    gaps = np.diff(levels)
    gaps = gaps[gaps > 1e-9 * max(float(np.ptp(levels)), 1e-300)]
    if len(gaps) == 0:
        return 0.0
    unit = float(gaps.min())
    whole: Mask = np.abs((levels - levels[0]) / unit - np.round((levels - levels[0]) / unit)) < 10.0 * WHOLE
    return unit if whole.all() else 0.0


def _without_motion(at: Indices, change: Array) -> tuple[Array, float]:
    """Return the sizes of jumps, shape (jumps,), less the motion around them, and their doubt."""
    before, after = change[np.maximum(at - 2, 0)], change[np.minimum(at, len(change) - 1)]
    sizes = np.abs(change[at - 1] - 0.5 * (before + after))
    return sizes, float(np.median(np.abs(before - after)))


def _power(jump: float, doubt: float) -> int:
    """Return the number of counts of a jump if it is a power of two, or one less; else 0."""
    likely = [2**bits - less for bits in BITS for less in (0, 1)]
    best = min(likely, key=lambda counts: abs(jump - counts))
    return best if abs(jump - best) <= max(doubt, COUNTS) and doubt < DOUBT * best else 0
