"""Smoothing differentiation of sampled positions, with a width chosen from the noise."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from itertools import pairwise
from math import comb, sqrt

import numpy as np
from numpy.typing import ArrayLike

from unmodelled.base.arrays import Array, Indices

#: Order of the polynomial; order 4 has the same derivative in the middle and is noisier at the ends.
ORDER = 3
#: Samples that choose the width.
ENOUGH = 300_000
#: Of double precision.
EPSILON = float(np.finfo(np.float64).eps)
#: How many times as far as on a plateau a signal moves between two of them, how many moves and steps from the
#: lowest plateau to the highest there are at least, and how many samples a move takes at most.
PLATEAU, PLATEAUS, LEVELS, AT_ONCE = 100.0, 10, 4, 2


def noise(y: Array) -> float:
    """Estimate the standard deviation of the white or quantisation noise on one smooth signal (samples,).

    Differences of order k remove a smooth signal and multiply the variance of white noise by C(2k, k). The
    order with the lowest estimate is taken; the median makes it robust to corners and jumps. A quantised
    signal has at least the noise of its quantum, quantum / sqrt(12).
    """
    difference, estimates = np.diff(y), []
    for order in range(2, 9):
        difference = np.diff(difference)
        estimates.append(1.4826 * float(np.median(np.abs(difference))) / sqrt(comb(2 * order, order)))
    return max(min(estimates), quantum(y) / sqrt(12.0))


def resolution(parts: Sequence[Array]) -> float:
    """Return the smallest quantum that any of the experiments (samples,) shows; 0 if there is none."""
    return min(filter(None, map(quantum, parts)), default=0.0)


def quantum(y: Array) -> float:
    """Return the step between the levels of a visibly quantised signal (samples,); 0 if there is none."""
    levels = np.unique(y)
    rounding = max(1e-9 * float(levels[-1] - levels[0]), 4.0 * EPSILON * float(np.max(np.abs(levels))))
    step = 0.0
    if len(levels) <= 0.9 * len(y):  # a straight ramp has equal steps too, but visits every level once
        gaps = np.diff(levels)
        step = _common_step(gaps[gaps > rounding])  # levels that only rounding separates are one level
    return step or _plateau_step(y, rounding)


def _common_step(sizes: Array) -> float:
    """The step of which nearly all sizes are whole multiples, about the smallest size; 0 if there is none."""
    if len(sizes) == 0:
        return 0.0
    step = float(np.median(sizes[sizes < 1.5 * sizes.min()]))
    regular = np.abs(sizes - np.round(sizes / step) * step) < 0.1 * step
    return step if np.mean(regular) > 0.9 else 0.0


def _plateau_step(y: Array, rounding: float) -> float:
    """The step between plateaus on which a signal stays most of the time; 0 if it has none.

    Resampling leaves values between two plateaus, and digits or another source of noise spread each of them
    a little.
    """
    change = np.diff(y)
    moving = np.abs(change) > max(rounding, PLATEAU * float(np.median(np.abs(change))))
    edges = np.flatnonzero(np.diff(np.concatenate([[0], moving, [0]])))
    first, last = edges[::2], edges[1::2]
    if len(first) < PLATEAUS:
        return 0.0
    path = np.concatenate([[0.0], np.cumsum(change)])
    jumps = np.abs(path[last] - path[first])
    step = _common_step(jumps[jumps > rounding])
    # a machine that goes to and fro between two stops is not quantised
    at_once = (last - first)[jumps < 1.5 * step]
    many = np.ptp(y) >= (LEVELS - 0.5) * step
    return step if step and many and np.median(at_once) <= AT_ONCE else 0.0


def smooth_derivative(y: Array, offsets: Indices, period: float) -> tuple[Array, Array, int]:
    """Estimate position and velocity from positions (samples,) by the filter of Savitzky and Golay.

    One width serves all experiments, so that the estimator is the same everywhere: the one with the smallest
    expected square error of the velocity, the noise that passes the filter plus the bias. The bias of a width
    shows in how far its velocity lies from that of half the width, beyond what the noise explains. The first
    and last samples of an experiment, where half a window is missing, have a width of their own, chosen in
    the same way for one-sided windows.
    """
    parts = [y[a:b] for a, b in pairwise(offsets)]
    some = parts[:: max(1, round(len(y) / ENOUGH))]
    variance = float(np.mean([noise(part) ** 2 for part in some]))
    widest = max(5, min(len(part) for part in parts) // 2)
    width = _width(some, variance, widest, centred=True)
    edge = _width(some, variance, widest, centred=False)
    position = [_filtered(part, width, edge, 0, period) for part in parts]
    velocity = [_filtered(part, width, edge, 1, period) for part in parts]
    return np.concatenate(position), np.concatenate(velocity), width


def _filtered(y: Array, width: int, edge: int, derivative: int, period: float) -> Array:
    result, ends = (filtered(y, one, derivative, period) for one in (width, edge))
    half = width // 2
    result[:half], result[-half:] = ends[:half], ends[-half:]
    return result


def _width(parts: list[Array], variance: float, widest: int, centred: bool) -> int:
    """The odd width with the smallest expected error of the velocity, at the middle or end of the window."""
    widths, bias, passed = [], [], []
    width = 5
    while width <= widest:
        widths.append(width)
        bias.append(_bias(parts, width, variance, centred))
        passed.append(variance * float(np.sum(_kernel(width, 1, centred) ** 2)))
        if bias[-1] > 2.0 * passed[-1] and _removed(parts, width) > 4.0 * variance:
            break  # so wide a window removes motion; from there on half of it does so too and says nothing
        width = max(width + 2, 2 * round(0.55 * width) + 1)
    # bias grows with the width, and that of wide windows is known best
    bounded = np.minimum.accumulate(bias[::-1])[::-1]
    return widths[int(np.argmin(bounded + np.array(passed)))]


def _removed(parts: list[Array], width: int) -> float:
    """Mean square of what smoothing over `width` samples takes away."""
    removes = -_kernel(width, 0, centred=True)
    removes[width // 2] += 1.0
    return _power(parts, removes)


def _bias(parts: list[Array], width: int, variance: float, centred: bool) -> float:
    """Mean square bias of the derivative (per sample) over `width` samples, by comparison with half of it."""
    half = max(5, 2 * (width // 4) + 1)
    if half == width:
        return 0.0
    between = _kernel(width, 1, centred).copy()
    first = (width - half) // 2 if centred else 0
    between[first : first + half] -= _kernel(half, 1, centred)
    return max(0.0, _power(parts, between) - variance * float(between @ between))


def _power(parts: list[Array], kernel: Array) -> float:
    """Mean square of the parts filtered by `kernel`, without the ends."""
    return float(np.mean(np.concatenate([np.convolve(part, kernel, "valid") ** 2 for part in parts])))


def _kernel(width: int, derivative: int, centred: bool) -> Array:
    """Coefficients for convolution; the value is that at the middle or, not centred, the last sample."""
    return kernel(width, derivative, width // 2 if centred else width - 1)


# Filter of Savitzky and Golay (1964): least squares by a cubic over a window that moves along the samples.
# SciPy has it too, in a package that takes half a second to load, and fits the cubic anew at each call. What
# depends on the window alone is computed once, and must not be written to.


@cache
def kernel(width: int, derivative: int, position: int) -> Array:
    """Return the coefficients (width,) that a window of samples is convolved with."""
    return np.array((_powers(width, derivative, position)[0] @ _fit(width))[::-1])


def filtered(y: Array, width: int, derivative: int, period: float) -> Array:
    """Return smoothed samples (samples,) or their slopes; half a window at either end lies on one cubic."""
    begin, end = _ends(width, derivative)
    parts = (
        begin @ (_fit(width) @ y[:width]),
        np.convolve(y, kernel(width, derivative, width // 2), "valid"),
        end @ (_fit(width) @ y[-width:]),
    )
    return np.asarray(np.concatenate(parts) / period**derivative)


@cache
def _fit(width: int) -> Array:
    """Coefficients of the cubic by the samples (ORDER + 1, width); the window reaches from -1 to 1."""
    return np.asarray(np.linalg.pinv(_powers(width, 0, np.arange(width))))


@cache
def _ends(width: int, derivative: int) -> tuple[Array, Array]:
    """Derivatives of the powers (half a window, ORDER + 1) before and after the middle."""
    half, positions = width // 2, np.arange(width)
    before, after = positions[:half], positions[half + 1 :]
    return _powers(width, derivative, before), _powers(width, derivative, after)


def _powers(width: int, derivative: int, positions: ArrayLike) -> Array:
    """Derivatives of the powers (positions, ORDER + 1) at samples of a window."""
    half = width // 2
    slopes = np.polynomial.polynomial.polyder(np.eye(ORDER + 1), derivative) / half**derivative
    at = (np.atleast_1d(positions) - half) / half
    return np.asarray(np.vander(at, len(slopes), increasing=True) @ slopes)
