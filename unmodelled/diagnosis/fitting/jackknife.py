"""Intervals of shared numbers: chance from experiment to experiment, and from one good model to another."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import stdtrit

from unmodelled.base.arrays import Array
from unmodelled.diagnosis.fitting.left_out import LeftOut
from unmodelled.diagnosis.fitting.normal_equations import RANK


def interval(
    prediction: LeftOut, name: str, level: float, alike: Sequence[LeftOut] = ()
) -> tuple[float, float]:
    """Return the interval of a shared number: jackknife, by Student's t, cut at the bounds.

    It covers chance from part to part, and what the number is in fits with other laws that predict left-out
    parts as well: which laws act changes most numbers by more than chance does.
    """
    names = [_same(name, prediction, other) for other in alike]
    others = [_jackknife(one, own, level) for one, own in zip(alike, names, strict=True) if own is not None]
    low, high = zip(_jackknife(prediction, name, level), *others, strict=True)
    return min(low), max(high)


def _same(name: str, prediction: LeftOut, other: LeftOut) -> str | None:
    """The name of a number in another fit; None where that has no such effect."""
    mine = next((e for e in prediction.fitted.hypothesis.effects if name in e.units), None)
    if mine is None:
        return name
    theirs = next((e for e in other.fitted.hypothesis.effects if e.key == mine.key), None)
    return None if theirs is None else dict(zip(mine.units, theirs.units, strict=True))[name]


def _jackknife(prediction: LeftOut, name: str, level: float) -> tuple[float, float]:
    unknown = next(u for u in prediction.fitted.unknowns.each if u.name == name)
    error = float(np.sqrt(covariance(prediction, [name])[0, 0]))
    reach = error * float(stdtrit(prediction.count - 1, 0.5 + 0.5 * level))
    value = prediction.fitted.fit.values[name]
    return max(value - reach, unknown.low), min(value + reach, unknown.high)


def covariance(prediction: LeftOut, names: Sequence[str]) -> Array:
    """Return the covariance (names, names), SI, of shared numbers: jackknife, and chance of own numbers."""
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
