"""Intervals of shared numbers from predictions of left-out parts: chance from experiment to experiment."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from unmodelled.diagnosis.fitting.left_out import LeftOut
from unmodelled.diagnosis.fitting.normal_equations import RANK

Array = NDArray[np.float64]


def interval(prediction: LeftOut, name: str, level: float) -> tuple[float, float]:
    """Return the jackknife interval of a shared number, by Student's t, cut at the bounds.

    It covers chance from part to part, not missing physics.

    Args:
        prediction: left-out predictions of a fitted hypothesis.
        name: name of an unknown that all experiments share.
        level: probability of the two-sided interval.

    Returns:
        Lower and upper end, SI.
    """
    unknowns = {u.name: u for u in prediction.fitted.unknowns.each}
    error = float(np.sqrt(covariance(prediction, [name])[0, 0]))
    reach = error * float(student.ppf(0.5 + 0.5 * level, prediction.count - 1))
    value = prediction.fitted.fit.values[name]
    return max(value - reach, unknowns[name].low), min(value + reach, unknowns[name].high)


def covariance(prediction: LeftOut, names: Sequence[str]) -> Array:
    """Return the covariance of shared numbers: jackknife, and chance of the experiments' own numbers.

    Args:
        prediction: left-out predictions of a fitted hypothesis.
        names: names of unknowns that all experiments share.

    Returns:
        Covariance, shape (names, names), SI.
    """
    unknowns = prediction.fitted.unknowns
    known = [u.name for u in unknowns.each]
    entries = np.searchsorted(unknowns.unknown, [known.index(name) for name in names])
    off = (prediction.values - prediction.values.mean(0))[:, entries]
    # the mean of own numbers is set to zero, and the steps to other experiments keep them
    moved = _moved_by_own(prediction)[:, entries]
    each = (prediction.count - 1) / len(off) * off.T @ off + moved.T @ moved
    return np.asarray(each * np.outer(unknowns.scale[entries], unknowns.scale[entries]))


def _moved_by_own(prediction: LeftOut) -> Array:
    """Moves (own unknowns, entries) of the vector by a standard error of the mean of own numbers.

    Of a machine whose motor constant differs between experiments, a few experiments know the mean no better
    than this: all other numbers follow it.
    """
    fitted = prediction.fitted
    unknowns, normal = fitted.unknowns, fitted.fit.normal
    z, own = fitted.vector(unknowns), [k for k, u in enumerate(unknowns.each) if u.own and not u.start]
    if not own:
        return np.zeros((0, len(z)))
    rest = ~np.isin(unknowns.unknown, own)
    H = normal.summed(*normal.reduced()[:2])[0]
    unit = 1.0 / np.sqrt(np.maximum(np.diag(H), 1e-300))
    scaled = H * unit * unit[:, None]
    inverse = np.linalg.pinv(scaled[np.ix_(rest, rest)], RANK, hermitian=True)
    found = np.zeros((len(own), len(z)))
    for k, number in enumerate(own):
        mine = unknowns.unknown == number
        error = float(z[mine].std(ddof=1) / np.sqrt(mine.sum()))
        found[k, rest] = -error * unit[rest] * (inverse @ (scaled[np.ix_(rest, mine)] @ (1.0 / unit[mine])))
    return found
