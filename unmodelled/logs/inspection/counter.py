"""Counters that overflow: a channel jumps by the same number of counts again and again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from unmodelled.base.arrays import Array, Indices
from unmodelled.logs.inspection.counts import count_of
from unmodelled.logs.inspection.signal import Finding, Run, Signal

KIND = "counter"
#: Size of a jump, in largest other steps: a counter moves by far less than its range between two samples.
LARGE = 8.0
#: Fewest jumps of one size where that is no power of two counts.
FEWEST = 3
#: Largest share of jumps among the samples, and longest excursion that is a spike, samples.
MOST, SPIKE = 0.05, 2
#: Powers of two that a counter's range can have.
BITS = range(7, 33)
#: Deviation of a jump from a power of two, counts, and largest doubt of its size from the motion around it.
COUNTS, DOUBT = 2.0, 0.02
#: Share of jumps at either end that do not count for their size: other jumps are close to some.
OUTER = 0.25
TURN = 2.0 * np.pi


@dataclass(frozen=True)
class _Overflow:
    """Jumps of one size in all runs."""

    size: float  # in the unit of the channel
    counts: int  # size in counts; 0: not known


def counter(runs: Sequence[Run]) -> tuple[list[Run], list[Finding]]:
    """Remove the jumps of counters that overflow, of one size in all runs.

    A position cannot jump; another channel is a counter only where its jumps are a power of two counts. The
    jumps start and end at the same places of the counter's range, and the channel goes on as before.
    """
    found, runs = list[Finding](), list(runs)
    for signal in runs[0].signals:
        parts = [run.values[signal.column] for run in runs]
        overflow = _overflow(parts, signal)
        if overflow is None:
            continue
        size = f"{overflow.size:.4g} {signal.unit}"
        by = f"{overflow.counts} counts ({size})" if overflow.counts else size
        what = f"jumps by {by} {{count}} times, as a counter that overflows,"
        cure = "the jumps were removed"
        for k, (run, values) in enumerate(zip(runs, parts, strict=True)):
            change = np.diff(values)
            turns = np.where(np.abs(change) > 0.5 * overflow.size, -np.sign(change), 0.0)
            at = np.flatnonzero(turns) + 1
            if len(at):
                added = overflow.size * np.cumsum(np.concatenate([[0.0], turns]))
                runs[k] = run.with_values(signal, values + added)
                first = float(run.t[at[0]] - run.t[0])
                found.append(Finding(KIND, signal.name, run.name, len(at), first, what, cure))
    return runs, found


def _overflow(parts: Sequence[Array], signal: Signal) -> _Overflow | None:
    values, change = np.concatenate(parts), np.concatenate([np.diff(part) for part in parts])
    size = np.abs(change)
    jumps = size > 0.5 * size.max()
    rest = float(size[~jumps].max(initial=0.0))
    if not 0 < jumps.sum() <= MOST * len(values) or size.max() < LARGE * rest or rest == 0.0:
        return None
    jumping = [part for part in parts if np.abs(np.diff(part)).max(initial=0.0) > 0.5 * size.max()]
    if signal.role != "position" and any(float(part.min()) >= signal.zero for part in jumping):
        return None  # where such a run begins in the counter's range, nobody knows
    at = np.flatnonzero(jumps)
    if np.ptp(size[jumps]) > 2.0 * rest or not _goes_on(at):
        return None
    middle, doubt = _without_motion(at, change)
    unit = count_of(values)
    counts = _power(middle / unit, doubt / unit) if unit else 0
    if signal.unit.strip() == "rad" and abs(middle - TURN) < 2.0 * rest:
        return None  # a wrapped angle
    if not counts and (signal.role != "position" or len(at) < FEWEST):
        return None
    modulus = counts * unit if counts else middle
    before = np.concatenate([part[:-1] for part in parts])[at]
    ends = np.concatenate([before, before + change[at]])
    around = np.remainder(ends - ends[0] + 0.5 * modulus, modulus)
    return None if np.ptp(around) > 4.0 * rest else _Overflow(modulus, counts)


def _goes_on(at: Indices) -> bool:
    """Return whether a jump is no spike: the channel does not jump back within two samples."""
    back = np.diff(at) <= SPIKE
    lone = np.ones(len(at), np.bool_)
    lone[1:] &= ~back
    lone[:-1] &= ~back
    return bool(lone.any())


def _without_motion(at: Indices, change: Array) -> tuple[float, float]:
    """Return the size of jumps less the motion, a cubic through the steps around each, and its doubt."""
    early, before, after, late = (change[np.clip(at + k, 0, len(change) - 1)] for k in (-2, -1, 1, 2))
    sizes = np.sort(np.abs(change[at] - (4.0 * (before + after) - early - late) / 6.0))
    outer = int(OUTER * len(sizes))
    return float(sizes[outer : len(sizes) - outer].mean()), float(np.median(np.abs(before - after)))


def _power(jump: float, doubt: float) -> int:
    """Return the number of counts of a jump if it is a power of two, or one less; else 0."""
    likely = [2**bits - less for bits in BITS for less in (0, 1)]
    best = min(likely, key=lambda counts: abs(jump - counts))
    return best if abs(jump - best) <= max(doubt, COUNTS) and doubt < DOUBT * best else 0
