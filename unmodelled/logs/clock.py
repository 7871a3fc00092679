"""Real clocks jitter and stop: checking the time of a log, and putting its samples on a uniform clock."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from scipy.interpolate import CubicSpline

from unmodelled.base.arrays import Array, Indices
from unmodelled.base.errors import BadInput
from unmodelled.logs.table import Columns
from unmodelled.logs.time_units import looks_like_days

Kind = Literal["cubic", "linear"]
#: Numbers of samples, or all of them.
Rows = Indices | slice
EVERY = slice(None)

SHORTEST_LOG = 50  # samples
LONGEST_GAP = 5.0  # sampling periods
TOLERANCE = 0.01  # relative, on the median period
UNIFORM = 1e-6  # periods
UNITS = {"milliseconds": 1e3, "microseconds": 1e6}  # in a second


def check_time(log: Columns) -> None:
    """Check column `t` of a log."""
    t, path = log.values["t"], log.path
    if len(t) == 0:
        raise BadInput(f"{path}: row 1: column t: no rows below it")
    if len(t) < SHORTEST_LOG:
        last = log.row(len(t) - 1)
        raise BadInput(
            f"{path}: row {last}: column t: must have {SHORTEST_LOG} samples or more, got {len(t)}"
        )
    if looks_like_days(t):
        raise BadInput(
            f"{path}: row {log.row(0)}: column t: must be in s, {t[0]:.10g} looks like days: write s"
        )
    steps = np.diff(t)
    back = np.flatnonzero(~(steps > 0.0))
    if len(back):
        i = int(back[0]) + 1
        raise BadInput(
            f"{path}: row {log.row(i)}: column t: time must increase, {t[i]:.10g} s follows {t[i - 1]:.10g} s"
        )
    parts(log)


def parts(log: Columns) -> list[Columns]:
    """Return the parts of a log between gaps of more than five sampling periods, at least 50 samples each."""
    t = log.values["t"]
    steps = np.diff(t)
    period = float(np.median(steps))
    gaps = np.flatnonzero(steps > LONGEST_GAP * period * (1.0 + 1e-9)) + 1
    if not len(gaps):
        return [log]
    ends = [0, *gaps.tolist(), len(t)]
    found = [log.among(slice(a, b)) for a, b in pairwise(ends) if b - a >= SHORTEST_LOG]
    if not found:
        i = int(gaps[0])
        raise BadInput(
            f"{log.path}: row {log.row(i)}: column t: gap of {steps[i - 1]:.4g} s, more than {LONGEST_GAP:g} "
            f"sampling periods of {period:.4g} s: no part without a gap has {SHORTEST_LOG} samples or more"
        )
    return found


def common_period(logs: Sequence[Columns]) -> float:
    """Return the sampling period on which all logs of a campaign are read, s.

    It is the median over logs whose periods agree within 1 %, and the longest one otherwise: reading a log
    more often than it was sampled would add samples that nothing measured.
    """
    medians = np.array([np.median(np.diff(log.values["t"])) for log in logs])
    shortest = float(medians.min())
    for log, median in zip(logs, medians, strict=True):
        if advice := _unit(median, shortest):
            raise BadInput(
                f"{log.path}: row {log.row(1)}: column t: median sampling period of {median:.6g} s, "
                f"{shortest:.6g} s in another experiment: {advice}"
            )
    periods = np.array([_period(log.values["t"]) for log in logs])
    alike = medians.max() <= (1.0 + TOLERANCE) * (1.0 + 1e-9) * medians.min()
    period = float(np.median(periods) if alike else periods.max())
    for log in logs:
        seconds = log.values["t"][-1] - log.values["t"][0]
        if not alike and seconds < (SHORTEST_LOG - 1) * period * (1.0 - UNIFORM):
            raise BadInput(
                f"{log.path}: row {log.row(0)}: column t: {seconds:.4g} s hold fewer than {SHORTEST_LOG} "
                f"samples of {period:.6g} s, the longest period of all experiments: leave one of them out"
            )
    plain = float(f"{period:.6g}")  # the period that was meant, if only rounding hides it
    return plain if abs(period - plain) < 1e-11 * plain else period


def _unit(period: float, other: float) -> str:
    """Return advice for a sampling period that is in another unit of time than those of other logs."""
    for unit, size in UNITS.items():
        if abs(period / other / size - 1.0) < TOLERANCE:
            return f"it looks like {unit}; multiply the column by {1.0 / size:g}"
    return ""


def _period(t: Array) -> float:
    """Slope of time over sample number, which averages jitter and rounding; a gap counts as lost samples."""
    k = np.arange(len(t), dtype=np.float64)
    slope = _slope(k, t)
    if not _uniform(t, slope):
        median = float(np.median(np.diff(t)))
        k = np.concatenate([[0.0], np.cumsum(np.maximum(1.0, np.round(np.diff(t) / median)))])
        slope = _slope(k, t)
    return slope


def _slope(k: Array, t: Array) -> float:
    centred = k - k.mean()
    return float(centred @ (t - t[0]) / (centred @ centred))


def _uniform(t: Array, period: float) -> bool:
    """Whether samples are uniform as far as the resolution of the logged time can tell."""
    off = t - t[0] - period * np.arange(len(t))
    return bool(0.5 * np.ptp(off) <= max(UNIFORM * period, 0.6 * _resolution(t)))


def _resolution(t: Array) -> float:
    """The step in which time was written, s: a decimal, or that of single precision; 0 if there is none."""
    for digits in range(10):
        scaled = t * 10.0**digits
        if np.all(np.abs(scaled - np.round(scaled)) < 1e-3):
            return float(10.0**-digits)
    single = t.astype(np.float32)
    return float(np.spacing(np.abs(single).max())) if np.all(single == t) else 0.0


def uniform_clock(t: Array, period: float) -> tuple[Array, float]:
    """Return the uniform instants (uniform samples,), s, at which to read a log with times t (samples,).

    The second number is how far samples moved, as a share of a period.
    """
    if _uniform(t, period):
        return t, 0.0
    clock = t[0] + period * np.arange(int((t[-1] - t[0]) / period + UNIFORM) + 1)
    phase = (t - t[0]) / period
    return np.minimum(clock, t[-1]), float(np.max(np.abs(phase - np.round(phase))))


def read_at(t: Array, values: Array, instants: Array, kind: Kind) -> Array:
    """Read logged values (samples,) at other instants (instants,), held beyond the ends.

    A cubic spline keeps the motion of an output, which is smooth; straight lines keep an input, which jumps,
    within what was commanded.
    """
    if instants is t:
        return values
    held = np.clip(instants, t[0], t[-1])
    if kind == "linear":
        return np.interp(held, t, values)
    return np.asarray(CubicSpline(t, values)(held))


@dataclass(frozen=True)
class Splines:
    """Cubic splines through the uniform samples of every experiment, held beyond its ends."""

    pieces: Array  # (4, samples), coefficients by powers of the share of a period, the highest first
    offsets: Indices  # (experiments + 1,), first samples

    @classmethod
    def of(cls, values: Array, offsets: Indices) -> Splines:
        """Return the splines through samples (samples,) of experiments with offsets (experiments + 1,)."""
        pieces = np.zeros((4, len(values)))
        pieces[3] = values
        for a, b in pairwise(offsets):
            pieces[:, a : b - 1] = CubicSpline(np.arange(b - a, dtype=np.float64), values[a:b]).c
        return cls(pieces, offsets)

    def ahead(self, steps: float, rows: Rows = EVERY) -> Array:
        """Return the values (rows,) some samples later.

        Examples:
            >>> squares = Splines.of(np.arange(5.0) ** 2, np.array([0, 5]))
            >>> squares.ahead(1.5).round(6).tolist()
            [2.25, 6.25, 12.25, 16.0, 16.0]
        """
        (shift, rest), rows = _whole(steps), np.arange(self.pieces.shape[1])[rows]
        experiment = np.searchsorted(self.offsets, rows, "right") - 1
        first, last = self.offsets[experiment], self.offsets[experiment + 1] - 1
        cubic, square, slope, value = self.pieces[:, np.clip(rows + shift, first, last)]
        later = ((cubic * rest + square) * rest + slope) * rest + value
        return np.asarray(np.where(rows + shift < first, value, later))


def delayed(values: Array, offsets: Indices, period: float, delays: Sequence[float], kind: Kind) -> Array:
    """Return uniform samples (samples, columns) after a delay of every column, s, held beyond all ends."""
    found = values.copy()
    for j, delay in enumerate(delays):
        if delay != 0.0:
            found[:, j] = _ahead(values[:, j], offsets, -delay / period, kind)
    return found


def _ahead(values: Array, offsets: Indices, steps: float, kind: Kind) -> Array:
    """Uniform samples (n,), read `steps` samples later, held beyond the ends of every experiment."""
    shift, rest = _whole(steps)
    if rest and kind == "cubic":
        return Splines.of(values, offsets).ahead(steps)
    before = _shifted(values, offsets, shift)
    return np.asarray(before + rest * (_shifted(values, offsets, shift + 1) - before)) if rest else before


def _shifted(values: Array, offsets: Indices, shift: int) -> Array:
    """Uniform samples (n,) a whole number of samples later, held beyond the ends of every experiment."""
    found = np.empty_like(values)
    for a, b in pairwise(offsets):
        by = max(a - b, min(shift, b - a))
        if by >= 0:
            found[a : b - by], found[b - by : b] = values[a + by : b], values[b - 1]
        else:
            found[a : a - by], found[a - by : b] = values[a], values[a : b + by]
    return found


def _whole(steps: float) -> tuple[int, float]:
    """Whole steps, and the rest of one."""
    nearest = round(steps)
    if abs(steps - nearest) < UNIFORM:
        return nearest, 0.0
    shift = int(np.floor(steps))
    return shift, steps - shift
