"""What the runs of a campaign are told to do: waves, sweeps, moves between rests, reversals, pauses."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from pipeline.rigs.withheld.machine import Range

Array = NDArray[np.float64]
TURN = 2.0 * np.pi
_SLOWEST = 0.3  # Hz


def references(t: Array, runs: int, extent: Range, rng: np.random.Generator) -> Array:
    """(samples, runs) smooth signals at times `t` (samples,), s; each kind in turn, in a drawn order."""
    order = rng.permutation(np.arange(runs) % len(_KINDS))
    columns = []
    for kind in order.tolist():
        wave = _KINDS[kind](t, extent.band, rng)
        size = extent.amplitude * rng.uniform(0.55, 1.0) * rng.choice([-1.0, 1.0])
        columns.append(size * wave * _smooth(t / min(0.25, 0.2 * t[-1])))
    return extent.centre + np.stack(columns, axis=1)


def _waves(t: Array, band: float, rng: np.random.Generator) -> Array:
    frequencies = np.geomspace(_SLOWEST, band, 5) * rng.uniform(0.85, 1.15, 5)
    waves = np.sin(TURN * np.multiply.outer(t, frequencies) + rng.uniform(0.0, TURN, 5))
    total = waves @ (frequencies / _SLOWEST) ** -0.7
    return np.asarray(total / np.max(np.abs(total)))


def _sweep(t: Array, band: float, rng: np.random.Generator) -> Array:
    growth = np.log(band / _SLOWEST) / t[-1]
    phase = TURN * _SLOWEST * np.expm1(growth * t) / growth
    return np.asarray(np.sin(phase + rng.uniform(-0.5, 0.5)) * np.exp(-0.6 * growth * t))


def _moves(t: Array, band: float, rng: np.random.Generator) -> Array:
    """From rest to rest, with pauses."""
    stops, rise = max(3, round(1.2 * t[-1])), 0.6 / band
    begin = (np.arange(stops) + rng.uniform(0.0, 0.3, stops)) * t[-1] / stops
    levels = rng.uniform(0.4, 1.0, stops) * (-1.0) ** np.arange(stops)
    steps = np.diff(levels, prepend=0.0)
    return sum((s * _smooth((t - b) / rise) for s, b in zip(steps, begin, strict=True)), np.zeros_like(t))


def _reversals(t: Array, band: float, rng: np.random.Generator) -> Array:
    """Ramps at an even speed that turn round sharply, but not at once."""
    phase = TURN * 0.4 * band * t + rng.uniform(0.0, TURN)
    return np.asarray(np.arcsin(0.97 * np.sin(phase)) / np.arcsin(0.97))


def _pauses(t: Array, band: float, rng: np.random.Generator) -> Array:
    """Waves that die down, a pause, and waves again."""
    middle, half, edge = rng.uniform(0.45, 0.65) * t[-1], 0.12 * t[-1], 0.08 * t[-1]
    away = np.abs(t - middle) - half
    return _waves(t, band, rng) * _smooth(away / edge)


_KINDS: tuple[Callable[[Array, float, np.random.Generator], Array], ...] = (
    _waves,
    _sweep,
    _moves,
    _reversals,
    _pauses,
)


def _smooth(s: Array) -> Array:
    """From 0 to 1 with a continuous third derivative."""
    s = np.clip(s, 0.0, 1.0)
    return np.asarray(s**4 * (35.0 - 84.0 * s + 70.0 * s**2 - 20.0 * s**3))
