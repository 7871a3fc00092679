"""Advice on the parameters of an identified distribution, from profiles and curvature."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from unmodelled.uncertainty.box import Box
from unmodelled.uncertainty.curvature import Curvature
from unmodelled.uncertainty.identify import on_bound
from unmodelled.uncertainty.profile import Profile, Profiles

#: Correlation of two estimates from which they are hard to tell apart.
CORRELATED = 0.9
#: Ratio of the ends of an interval of positive numbers from which only the order of magnitude is known.
VAGUE = 4.0
#: Share of a flat direction, of length 1, from which a parameter takes part in it.
TAKES_PART = 0.2


def advice(names: Sequence[str], found: Profiles, bend: Curvature) -> list[str]:
    """Return sentences on intervals, on correlated parameters and on parameters at a bound."""
    better = (
        [f"the profiles found a better optimum: its log-likelihood is higher by {found.gain:.3g}"]
        if found.gain > 0.0
        else []
    )
    return [
        *better,
        *(_limits(names[c.index], float(found.alpha[c.index]), c) for c in found.curves),
        *(line for c in found.curves for line in _bound(names[c.index], found, c)),
        *_correlated(names, bend),
        *_flat(names, bend),
    ]


def _limits(name: str, best: float, curve: Profile) -> str:
    low, high = curve.low, curve.high
    if low is None and high is None:
        return f"{name} cannot be identified: the data allow all of its bounds, {_range(*curve.bounds)}"
    if low is None:
        return f"{name} = {best:.4g} has no lower limit: the data allow all from its bound to {high:.4g}"
    if high is None:
        return f"{name} = {best:.4g} has no upper limit: the data allow all from {low:.4g} to its bound"
    vague = low > 0.0 and high > VAGUE * low
    known = "is known only in its order of magnitude" if vague else "is identified"
    return f"{name} = {best:.4g} {known}: 95 % interval {_range(low, high)}"


def _range(low: float, high: float) -> str:
    return f"{low:.4g} to {high:.4g}"


def _bound(name: str, found: Profiles, curve: Profile) -> list[str]:
    best = found.alpha[[curve.index]]
    if not on_bound(Box(np.array([curve.bounds])), best)[0]:
        return []
    low, high = curve.bounds
    side = "lower" if best[0] - low < high - best[0] else "upper"
    return [f"{name} lies on its {side} bound {best[0]:.4g}: widen the bounds or hold it fixed"]


def _correlated(names: Sequence[str], bend: Curvature) -> list[str]:
    pairs = [(i, j, float(bend.correlation[i, j])) for i, j in combinations(range(len(names)), 2)]
    return [
        f"{names[i]} and {names[j]} are hard to tell apart: their estimates are correlated ({value:.2f})"
        for i, j, value in pairs
        if abs(value) > CORRELATED
    ]


def _flat(names: Sequence[str], bend: Curvature) -> list[str]:
    groups = [[n for n, x in zip(names, row, strict=True) if abs(x) > TAKES_PART] for row in bend.flat]
    return [
        f"{group[0]} does not change the log-likelihood at the optimum: hold it fixed"
        if len(group) == 1
        else f"{', '.join(group[:-1])} and {group[-1]} can change together without changing the "
        "log-likelihood: hold one of them fixed"
        for group in groups
    ]
