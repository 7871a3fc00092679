"""Faults of logs, planted in one channel of every run, and faultless logs that look like them."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pandas as pd

from tests.inspection.machines import SCREW, rounded
from tests.machines.folders import Array

Frames = dict[str, pd.DataFrame]


def _each(frames: Frames, column: str, change: Callable[[Array, int], Array]) -> Frames:
    """Return frames with one column changed, which gets the values and the number of the run."""
    return {
        name: frame.assign(**{column: change(frame[column].to_numpy().copy(), k)})
        for k, (name, frame) in enumerate(frames.items())
    }


def spiked(frames: Frames, column: str, size: float, seed: int = 1) -> Frames:
    """Add garbage in about 1 % of the samples, every other time two samples long."""

    def spoil(values: Array, run: int) -> Array:
        rng = np.random.default_rng([seed, run])
        at = 20 + np.flatnonzero(rng.random(len(values) - 40) < 0.01)
        values[at] += rng.uniform(0.8, 3.0, len(at)) * size * rng.choice([-1.0, 1.0], len(at))
        values[at[::2] + 1] = values[at[::2]]
        return values

    return _each(frames, column, spoil)


def dropped(frames: Frames, column: str, share: float = 0.05, seed: int = 2) -> Frames:
    """Set a share of the samples to zero."""

    def spoil(values: Array, run: int) -> Array:
        values[np.random.default_rng([seed, run]).random(len(values)) < share] = 0.0
        return values

    return _each(frames, column, spoil)


def wrapped(frames: Frames, column: str, count: float, bits: int) -> Frames:
    """Let the counter of a channel overflow, from its largest to its smallest number."""
    half = 2 ** (bits - 1)
    over = lambda v, _: count * (np.remainder(np.round(v / count) + half, 2 * half) - half)  # noqa: E731
    return _each(frames, column, over)


def emptied(frames: Frames, column: str, count: float, bits: int) -> Frames:
    """Let the counter of a channel fall to zero where it overflows."""
    top = 2 ** (bits - 1) - 1
    over = lambda v, _: count * np.sign(v) * np.remainder(np.abs(np.round(v / count)), top)  # noqa: E731
    return _each(frames, column, over)


def frozen(frames: Frames, column: str, samples: int, start: int = 400) -> Frames:
    """Repeat one value of a channel for some samples."""

    def spoil(values: Array, run: int) -> Array:
        first = start + 60 * run
        values[first : first + samples] = values[first]
        return values

    return _each(frames, column, spoil)


def _screw(
    force: Callable[[Array, np.random.Generator], Array],
    rates: Callable[[Array, Array], Array] = SCREW.rates,
    count: float = 2e-6,
) -> Frames:
    """Return logs of the ball screw with other forces, laws or encoder."""
    rng, t = np.random.default_rng(5), SCREW.period * np.arange(1600)
    u = np.array([force(t, rng) for _ in range(4)])
    s = rounded(replace(SCREW, rates=rates).states_at(u)[0], count)
    return {f"run{k + 1}": pd.DataFrame({"t": t, "force": u[k], "s": s[k]}) for k in range(4)}


def _slow(t: Array, rng: np.random.Generator) -> Array:
    return np.asarray(40.0 * np.sin(2.0 * np.pi * rng.uniform(0.4, 0.8) * t))


def _quick(t: Array, rng: np.random.Generator) -> Array:
    beat = 1.0 + 0.8 * np.sin(2.0 * np.pi * 0.1 * t)
    return np.asarray(40.0 * beat * np.sin(2.0 * np.pi * rng.uniform(1.0, 1.4) * t))


def _stop(x: Array, u: Array) -> Array:
    """Rates of the screw between stiff ends at 8 mm, from which it bounces."""
    deep = np.maximum(np.abs(x[0]) - 0.008, 0.0)
    return np.array([x[1], (u - 40.0 * x[1] - 1e6 * np.sign(x[0]) * deep) / 12.0])


def _sticking(x: Array, u: Array) -> Array:
    """Rates of the screw with a dry friction in which it sticks."""
    still = (np.abs(x[1]) < 1e-4) & (np.abs(u) < 25.0)
    free = (u - 40.0 * x[1] - 25.0 * np.sign(x[1] + 1e-12 * u)) / 12.0
    return np.array([np.where(still, 0.0, x[1]), np.where(still, -x[1] / SCREW.period, free)])


#: Makers of faultless logs that could be taken for faulty ones.
TWINS: dict[str, Callable[[], Frames]] = {
    "faultless": SCREW.frames,
    "encoder of low resolution": lambda: _screw(_slow, count=5e-4),
    "rest, then motion": lambda: _screw(lambda t, rng: np.where(t < 2.0, 0.0, _slow(t, rng))),
    "rest": lambda: {**_screw(_slow), "still": _screw(lambda t, rng: 1e-3 * _slow(t, rng))["run1"]},
    "saturated command": lambda: _screw(lambda t, rng: np.clip(2.0 * _slow(t, rng), -40.0, 40.0)),
    "square wave": lambda: _screw(lambda t, rng: 40.0 * np.sign(_slow(t, rng))),
    "steps": lambda: _screw(lambda t, rng: rng.uniform(-40.0, 40.0, 60)[(t / 0.12).astype(np.int64)]),
    "modulated width": lambda: _screw(
        lambda t, rng: 40.0 * (rng.random(len(t)) < 0.5 + 0.01 * _slow(t, rng))
    ),
    "blows of a hammer": lambda: _screw(lambda t, rng: 900.0 * (rng.random(len(t)) < 0.01)),
    "ramp, held": lambda: _screw(lambda t, rng: 20.0 * np.clip(t - 1.0, 0.0, 1.0) * (t < 3.0)),
    "end stops": lambda: _screw(_slow, _stop),
    "dry friction": lambda: _screw(_slow, _sticking),
    "few samples a period": lambda: {name: frame[::27] for name, frame in _screw(_quick).items()},
    "coarse dry friction": lambda: _screw(_slow, _sticking, 2e-4),
}
