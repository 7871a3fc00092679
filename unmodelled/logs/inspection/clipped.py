"""Sensors that end: a channel stands at its largest or smallest value while the machine goes beyond it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from unmodelled.base.arrays import Array, Mask
from unmodelled.logs.clock import LONGEST_GAP
from unmodelled.logs.differentiate import noise, quantum
from unmodelled.logs.inspection.frozen import NOISY, REPEATED, enough_without, stretches_of
from unmodelled.logs.inspection.signal import Finding, Run, Signal
from unmodelled.logs.inspection.spikes import quick_at

KIND = "clipped"
#: Fewest samples at an end, and their number in that of a channel that comes near it by chance.
FEWEST, MANY = 10, 5.0
#: Steps of a coarse channel by which its pace before an end would lead beyond it, at least; a peak within one
#: step leads 3 beyond. Pace is over this many steps, two samples or more, and changes by less than a factor
#: on the way: from rest it doubles at least, and 5 samples after a peak it grows by a third at most.
BEYOND, PACED, EVEN = 6.0, 3.0, 1.6
#: Smallest grain of a channel without any noise, in its range.
ROUNDING = 1e-9
#: Smallest and largest value of a channel; infinite where its range has no end.
Ends = tuple[float, float]
ENDLESS: Ends = (-np.inf, np.inf)


@dataclass(frozen=True)
class Clipped:
    """A channel with an end of its range, in all runs."""

    signal: Signal
    ends: Ends
    rows: list[Mask]  # samples at an end, (samples,) of every run
    sure: bool = True  # whether it is the sensor that ends there, and not the machine

    @property
    def values(self) -> str:
        """Return the ends in words."""
        named = zip(("smallest", "largest"), self.ends, strict=True)
        found = [(word, self.signal.shown(end)) for word, end in named if np.isfinite(end)]
        words, numbers = (" or ".join(each) for each in zip(*found, strict=True))
        return f"{words} value ({numbers})"

    @property
    def share(self) -> str:
        """Return where the channel stands and in which share of the samples, in words."""
        share = 100.0 * float(np.mean(np.concatenate(self.rows)))
        return f"stands at its {self.values} in {share:.2g} % of the samples"

    @property
    def cuts(self) -> bool:
        """Return whether runs are to be cut at these samples: the states are unknown there."""
        return self.signal.role in ("input", "position")

    @property
    def cured(self) -> bool:
        """Return whether enough remains without the samples of a sensor that ends."""
        return self.sure and (not self.cuts or all(enough_without(_wide(rows)) for rows in self.rows))

    def findings(self, runs: Sequence[Run]) -> Iterator[Finding]:
        """Yield a finding for every run with such samples."""
        cure = "these are left out; a sensor with a larger range shows more"
        if not self.sure:
            cure = "if the sensor ends there, leave these times out or measure with a larger range"
        elif not self.cured:
            cure = "too little remains without these; measure with a larger range"
        what = f"{self.share}, {{count}} of them"
        for run, rows in zip(runs, self.rows, strict=True):
            if rows.any():
                first = float(run.t[np.argmax(rows)] - run.t[0])
                yield Finding(
                    KIND, self.signal.name, run.name, int(rows.sum()), first, what, cure, self.cured
                )


def clipped(runs: Sequence[Run]) -> tuple[list[Run], list[Finding], dict[str, Ends]]:
    """Leave out samples at the ends of measured channels; return runs, findings, and ends by column.

    A sensor with noise never shows one number again and again, save at the end of its range. What an input or
    a position was there is unknown, and so are the states that it drives: runs are cut. The samples of
    another output stay, and are not compared. A command that saturates is no fault.
    """
    found, runs, limits = list[Finding](), list(runs), dict[str, Ends]()
    for signal in runs[0].signals:
        mine = clipped_of(runs, signal)
        found += mine.findings(runs) if mine else ()
        if mine is None or not mine.cured:
            continue
        if mine.cuts:
            pairs = zip(runs, mine.rows, strict=True)
            runs = [run.without(_wide(rows)) if rows.any() else run for run, rows in pairs]
        else:
            limits[signal.column] = mine.ends
    return runs, found, limits


def clipped_of(runs: Sequence[Run], signal: Signal) -> Clipped | None:
    """Return the ends of the range of a channel in all runs; None where it shows none."""
    return _clipped(runs, signal) or _passed(runs, signal)


def _wide(rows: Mask) -> Mask:
    """Return samples (samples,) with those beside short stretches, so that runs are cut there.

    Otherwise, an input would be read straight across a peak that nobody knows.
    """
    wide = rows.copy()
    edges = np.flatnonzero(np.diff(np.concatenate([[False], rows, [False]]).astype(np.int8)))
    for start, end in edges.reshape(-1, 2).tolist():
        more = max(0, -((end - start - int(LONGEST_GAP)) // 2))
        wide[max(0, start - more) : end + more] = True
    return wide


def _clipped(runs: Sequence[Run], signal: Signal) -> Clipped | None:
    parts = [run.values[signal.column] for run in runs]
    # of a speed from counts of an encoder, every run can show another step
    values, step = np.concatenate(parts), max(map(quantum, parts))
    ends = float(values.min()), float(values.max())
    if not signal.measured or ends[0] == ends[1]:
        return None
    grain = float(np.median([noise(part) for part in parts]))
    if grain < max(step, NOISY * (ends[1] - ends[0])):
        return None  # without noise, a machine may stand there as well
    at = [bool(end != signal.zero and _stands(parts, end, grain, step)) for end in ends]
    if not any(at) or (step == 0.0 and _repeats(parts, ends)):
        return None
    low, high = (end if is_one else none for end, is_one, none in zip(ends, at, ENDLESS, strict=True))
    return Clipped(signal, (low, high), [(part <= low) | (part >= high) for part in parts])


def _stands(parts: Sequence[Array], end: float, grain: float, step: float) -> bool:
    """Return whether values (samples,) are equal to an end more often than noise of such a size allows.

    A value at which a channel freezes does not recur: the end is reached from elsewhere, twice or more.
    """
    off = np.abs(np.concatenate(parts) - end)
    near = np.count_nonzero((off > 0.0) & (off <= grain))
    visits = sum(int(np.count_nonzero(np.diff(part == end, prepend=False) & (part == end))) for part in parts)
    many = max(FEWEST - 1, MANY * near * step / grain)
    return bool(np.count_nonzero(off == 0.0) > many and visits > 1)


def _repeats(parts: Sequence[Array], ends: Ends) -> bool:
    """Return whether a channel repeats its numbers away from its ends, too."""
    inner = [(part[1:] > ends[0]) & (part[1:] < ends[1]) for part in parts]
    same = [np.diff(part) == 0.0 for part in parts]
    count = sum(int(mask.sum()) for mask in inner)
    return sum(int((a & b).sum()) for a, b in zip(inner, same, strict=True)) > REPEATED * count


def _passed(runs: Sequence[Run], signal: Signal) -> Clipped | None:
    """Return the ends of a channel without visible noise: it moves on, stands there, and moves on again.

    A machine that settles slows down before, and one that leaves a stop starts slowly: a position without a
    pace of its own is none of a machine. Another channel may change its pace; where steps do not hide its
    noise, it has none, and an input that jumps turns its course.
    """
    parts = [run.values[signal.column] for run in runs]
    values, is_position = np.concatenate(parts), signal.role == "position"
    step = max(map(_grain if is_position else quantum, parts))
    if not signal.measured or step == 0.0 or np.ptp(values) == 0.0:
        return None
    ends = float(values.min()), float(values.max())
    visits = [0, 0]
    for run, part in zip(runs, parts, strict=True):
        turned = np.zeros(len(part), np.bool_) if is_position else quick_at(run, signal)
        for stretch in stretches_of(part):
            if part[stretch[0]] in ends and _goes_beyond(part, stretch, step, turned):
                visits[ends.index(part[stretch[0]])] += 1
    at = [count > 1 and end != signal.zero for count, end in zip(visits, ends, strict=True)]
    if not any(at):
        return None
    low, high = (end if is_one else none for end, is_one, none in zip(ends, at, ENDLESS, strict=True))
    return Clipped(signal, (low, high), [(part <= low) | (part >= high) for part in parts], sure=is_position)


def _grain(values: Array) -> float:
    """Return the size below which values (samples,) say nothing: their step, noise or rounding."""
    return max(quantum(values), noise(values), ROUNDING * float(np.ptp(values)))


def _goes_beyond(values: Array, stretch: tuple[int, int], step: float, turned: Mask) -> bool:
    """Return whether the pace before and after a stretch leads far beyond it within half of its time.

    Where inputs jump, in the mask (samples,) `turned`, within a step of either end, the pace changes there.
    """
    start, end = stretch
    pace = min(_pace(values[:start][::-1], step), _pace(values[end:], step))
    if 0.5 * (end - start) * pace <= BEYOND * step:
        return False
    near = int(step / pace) + 1
    return not (turned[max(0, start - near) : start + near].any() or turned[end - near : end + near].any())


def _pace(away: Array, step: float) -> float:
    """Return the even pace of a course (samples,), per sample, near its first sample; 0 if it has none."""
    gone = np.abs(away - away[:1])
    far = np.flatnonzero(gone >= PACED * step)
    reach = max(int(far[0]), 2) if len(far) else len(away)
    if len(away) <= 2 * reach:
        return 0.0
    first, second = float(gone[reach]), float(gone[2 * reach] - gone[reach])
    return first / reach if second / EVEN <= first <= EVEN * second else 0.0
