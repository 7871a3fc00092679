"""Sensors that end: a channel stands at its largest or smallest value while the machine goes beyond it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from unmodelled.base.arrays import Array, Mask
from unmodelled.logs.differentiate import noise, quantum
from unmodelled.logs.inspection.frozen import NOISY, REPEATED, enough_without
from unmodelled.logs.inspection.signal import Finding, Run, Signal

KIND = "clipped"
#: Fewest samples at an end, and their number in that of a channel that comes near it by chance.
FEWEST, MANY = 10, 5.0
#: Smallest and largest value of a channel; infinite where its range has no end.
Ends = tuple[float, float]
ENDLESS: Ends = (-np.inf, np.inf)


@dataclass(frozen=True)
class _Clipped:
    """A channel with an end of its range, in all runs."""

    signal: Signal
    ends: Ends
    rows: list[Mask]  # samples at an end, (samples,) of every run

    @property
    def values(self) -> str:
        """Return the ends in words."""
        named = zip(("smallest", "largest"), self.ends, strict=True)
        found = [(word, self.signal.shown(end)) for word, end in named if np.isfinite(end)]
        words, numbers = (" or ".join(each) for each in zip(*found, strict=True))
        return f"{words} value ({numbers})"

    def findings(self, runs: Sequence[Run], cured: bool) -> Iterator[Finding]:
        """Yield a finding for every run with such samples."""
        cure = "these are left out; a sensor with a larger range shows more"
        cure = cure if cured else "too little remains without these; measure with a larger range"
        share = 100.0 * float(np.mean(np.concatenate(self.rows)))
        what = f"stands at its {self.values} in {share:.2g} % of the samples, {{count}} of them"
        for run, rows in zip(runs, self.rows, strict=True):
            if rows.any():
                first = float(run.t[np.argmax(rows)] - run.t[0])
                yield Finding(KIND, self.signal.name, run.name, int(rows.sum()), first, what, cure, cured)


def clipped(runs: Sequence[Run]) -> tuple[list[Run], list[Finding], dict[str, Ends]]:
    """Leave out samples at the ends of measured channels; return runs, findings, and ends by column.

    A sensor with noise never shows one number again and again, save at the end of its range. What an input or
    a position was there is unknown, and so are the states that it drives: runs are cut. The samples of
    another output stay, and are not compared. A command that saturates is no fault.
    """
    found, runs, limits = list[Finding](), list(runs), dict[str, Ends]()
    for signal in runs[0].signals:
        mine = _clipped(runs, signal)
        if mine is None:
            continue
        cuts = signal.role in ("input", "position")
        cured = not cuts or all(map(enough_without, mine.rows))
        found += mine.findings(runs, cured)
        if not cured:
            continue
        if cuts:
            runs = [
                run.without(rows) if rows.any() else run for run, rows in zip(runs, mine.rows, strict=True)
            ]
        else:
            limits[signal.column] = mine.ends
    return runs, found, limits


def _clipped(runs: Sequence[Run], signal: Signal) -> _Clipped | None:
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
    return _Clipped(signal, (low, high), [(part <= low) | (part >= high) for part in parts])


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
