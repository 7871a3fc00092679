"""Regions of the coordinates in which corrections are disproportionately large."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from unmodelled.base.arrays import Array, Indices
from unmodelled.diagnosis.where.coordinates import Coordinate
from unmodelled.diagnosis.where.corrections import Corrections
from unmodelled.effects.place import Place

#: Density of a region, at least [share of the correction per share of the samples].
REGION_DENSITY = 1.5
#: Distance of the density of a region above one, at least [standard errors].
REGION_T = 2.0
#: Share of a region, at least [share of the squared correction].
REGION_SHARE = 0.1
#: Largest number of regions listed [regions].
MOST_REGIONS = 6
#: Bins of a coordinate, at most, and windows in each of them, at least.
MOST_BINS, FEWEST_PER_BIN = 24, 30


@dataclass(frozen=True)
class _Region:
    signal: str
    low: float
    high: float
    share: float
    samples: float

    @property
    def telling(self) -> float:
        return self.share * float(np.log(self.share / self.samples))


def regions(corrections: Corrections, channels: tuple[str, ...]) -> tuple[dict[str, Any], ...]:
    """Return intervals of signals with much more of the squared correction than of the samples.

    Noise is subtracted, and a region must stand out whichever experiment is left out. Signals are the
    coordinates of the channel and, of a port, the inputs too; `mod(theta, 2*pi)` is the position within a
    turn, `d(v)/dt` an acceleration.
    """
    found: dict[tuple[str, float], _Region] = {}
    for k, place in enumerate(corrections.places):
        if place.channel in channels:
            for region in _of_place(corrections, k, place):
                found.setdefault((region.signal, region.low), region)
    telling = sorted(found.values(), key=lambda region: -region.telling)[:MOST_REGIONS]
    rows = [asdict(region) for region in sorted(telling, key=lambda region: -region.share)]
    return tuple({key: row[key] for key in ("signal", "low", "high", "share")} for row in rows)


def _of_place(corrections: Corrections, k: int, place: Place) -> list[_Region]:
    seen = corrections.seen[:, k]
    if not seen.any():  # windows that say nothing about the place, as where its effort is far too small
        return []
    excess = corrections.value[seen, k] ** 2 - corrections.error[seen, k] ** 2
    group = np.unique(corrections.group[seen], return_inverse=True)[1]
    coordinates = corrections.coordinates
    signals = list(coordinates.of(place))
    if place.kind == "port":
        signals += [coordinates.of(p)[0] for p in corrections.places if p.kind == "actuator"]
    return [r for signal in signals for r in _along(signal, signal.values[seen], excess, group)]


def _along(signal: Coordinate, values: Array, excess: Array, group: Indices) -> list[_Region]:
    count = int(np.clip(len(values) // FEWEST_PER_BIN, 2, MOST_BINS))
    edges = np.unique(np.quantile(values, np.linspace(0.0, 1.0, count + 1)))
    if len(edges) < 3:
        return []
    bins = np.searchsorted(edges[1:-1], values, "right")
    sums, counts = (
        _table(bins, group, weights, len(edges) - 1) for weights in (excess, np.ones_like(excess))
    )
    dense = _bridged(_dense(sums, counts), sums, counts)
    found = []
    ends = np.flatnonzero(np.diff(np.concatenate([[0], dense, [0]])))
    for first, last in ends.reshape(-1, 2).tolist():
        share, samples = _held(sums, counts, first, last)
        if share >= REGION_SHARE:
            low, high = float(edges[first]), float(edges[last])
            found.append(_Region(signal.name, low, high, min(share, 1.0), samples))
    return found


def _table(bins: Indices, group: Indices, weights: Array, count: int) -> Array:
    """(groups, bins) sums of weights."""
    groups = int(group.max(initial=-1)) + 1
    found = np.bincount(group * count + bins, weights, groups * count)
    return np.asarray(found.reshape(groups, count), np.float64)


def _held(sums: Array, counts: Array, first: int, last: int) -> tuple[float, float]:
    """Share of some bins in the sum, and in the samples."""
    share, samples = (float(table[:, first:last].sum() / table.sum()) for table in (sums, counts))
    return share, samples


def _bridged(dense: Indices, sums: Array, counts: Array) -> Indices:
    """With single bins between dense ones, where a force changes its sign for instance, if all three are."""
    found = dense.copy()
    for k in range(1, len(dense) - 1):
        share, samples = _held(sums, counts, k - 1, k + 2)
        found[k] |= dense[k - 1] & dense[k + 1] & (share >= REGION_DENSITY * samples)
    return found


def _dense(sums: Array, counts: Array) -> Indices:
    """(bins,) 1 where a bin has much more of the sum than of the samples, whichever group is left out."""
    n = len(sums)
    if n < 2 or sums.sum() <= 0.0:
        return np.zeros(sums.shape[1], np.int64)

    def density(s: Array, c: Array) -> Array:
        share = s / np.maximum(s.sum(-1, keepdims=True), 1e-300)
        return np.asarray(share / np.maximum(c / c.sum(-1, keepdims=True), 1e-12))

    with np.errstate(invalid="ignore", over="ignore"):  # the group left out had all
        whole = density(sums.sum(0), counts.sum(0))
        without = density(sums.sum(0) - sums, counts.sum(0) - counts)
        error = np.sqrt((n - 1) / n * np.sum((without - without.mean(0)) ** 2, axis=0))
    dense = (whole >= REGION_DENSITY) & (whole - REGION_T * error > 1.0)
    return np.asarray(dense, np.int64)
