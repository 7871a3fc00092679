"""Families of input signals: holds, ramps, slow reversals, multisines and chirps, within the input limits.

A signal of a family is a point of the unit cube for every input; the first coordinate is the amplitude and
the second one the offset, both relative to the limits. Every signal starts and ends at the input closest to
zero, in the unit of its column.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.design.limits import Limits

#: Levels or knots of a signal, and sines of a multisine.
LEVELS, SINES = 8, 4
#: Samples per period of the highest frequency: the ear of a sampled controller and of the Runge-Kutta method.
SAMPLES_PER_PERIOD = 20


@dataclass(frozen=True)
class Family:
    """Family of signals."""

    name: str  # in words
    size: int  # coordinates per input, amplitude and offset included
    #: Coordinates (designs, size - 2), time as a share (samples,), most cycles -> -1 to 1 (designs, samples).
    wave: Callable[[Array, Array, float], Array]

    def inputs(self, z: Array, limits: Limits) -> Array:
        """Return signals (designs, samples, inputs), SI, of points (designs, inputs times size)."""
        share = np.linspace(0.0, 1.0, limits.samples)
        cycles = limits.duration / (SAMPLES_PER_PERIOD * limits.period)
        found = []
        for k, own in enumerate(limits.inputs):
            one = z[:, k * self.size : (k + 1) * self.size]
            amplitude, offset = one[:, :1], (2.0 * one[:, 1:2] - 1.0) * (1.0 - one[:, :1])
            v = np.clip(amplitude * self.wave(one[:, 2:], share, max(cycles, 1.0)) + offset, -1.0, 1.0)
            rest = own.rest
            u = rest + np.where(v > 0.0, v * (own.high - rest), v * (rest - own.low))
            found.append(_rated(u, rest, own.rate * limits.period))
        return np.stack(found, axis=-1)


def _rated(u: Array, rest: float, step: float) -> Array:
    """Signals (designs, samples) that start and end at `rest` and change by at most `step` per sample."""
    u = u.copy()
    u[:, [0, -1]] = rest
    if np.isfinite(step):
        way = step * np.arange(u.shape[1])[::-1]  # the farthest from which there is time to come back
        u = np.clip(u, rest - way, rest + way)
        for k in range(1, u.shape[1] - 1):
            u[:, k] = u[:, k - 1] + np.clip(u[:, k] - u[:, k - 1], -step, step)
    return u


def _holds(z: Array, share: Array, _: float) -> Array:
    number = np.minimum((share * z.shape[1]).astype(np.int64), z.shape[1] - 1)
    return np.asarray(2.0 * z[:, number] - 1.0)


def _ramps(z: Array, share: Array, _: float) -> Array:
    knots = np.column_stack([np.zeros(len(z)), 2.0 * z - 1.0])
    at = share * (knots.shape[1] - 1)
    left = np.minimum(at.astype(np.int64), knots.shape[1] - 2)
    return np.asarray(knots[:, left] + (at - left) * (knots[:, left + 1] - knots[:, left]))


def _reversals(z: Array, share: Array, most: float) -> Array:
    """Triangle waves whose amplitude grows or falls."""
    phase = np.minimum(most, 20.0) ** z[:, :1] * share
    triangle = 2.0 / np.pi * np.arcsin(np.sin(2.0 * np.pi * phase))
    return np.asarray(
        triangle * (z[:, 1:2] + (1.0 - z[:, 1:2]) * np.where(z[:, 2:] > 0.5, share, 1.0 - share))
    )


def _multisine(z: Array, share: Array, most: float) -> Array:
    """Sines between two frequencies, with phases of their own."""
    low, high = most ** np.minimum(z[:, 0], z[:, 1]), most ** np.maximum(z[:, 0], z[:, 1])
    total = np.zeros((len(z), len(share)))
    for k in range(SINES):
        cycles = low * (high / low) ** (k / (SINES - 1))
        total += np.sin(2.0 * np.pi * (np.outer(cycles, share) + z[:, 2 + k, None]))
    return np.asarray(total / np.abs(total).max(axis=1, keepdims=True))


def _chirp(z: Array, share: Array, most: float) -> Array:
    """Sines whose frequency grows or falls exponentially."""
    first, last = most ** z[:, :1], most ** z[:, 1:2]
    ratio = np.log(last / first)
    ratio = np.where(np.abs(ratio) < 1e-6, 1e-6, ratio)
    return np.asarray(np.sin(2.0 * np.pi * first * np.expm1(ratio * share) / ratio))


CHIRP = Family("chirp", 4, _chirp)
FAMILIES = (
    Family("steps and holds", 2 + LEVELS, _holds),
    Family("ramps", 2 + LEVELS, _ramps),
    Family("slow reversals", 5, _reversals),
    Family("multisine", 4 + SINES, _multisine),
    CHIRP,
)
#: Amplitudes of a reference, from which the largest one within the limits is taken.
AMPLITUDES = np.linspace(1.0, 0.05, 20)


def references(limits: Limits, seed: int) -> Mapping[str, Array]:
    """Return experiments (amplitudes, samples, inputs), SI, to compare with, the largest amplitude first.

    `chirp` sweeps every input from one cycle in the experiment to the highest frequency, `random` holds
    random levels.
    """
    points = reference_points(len(limits.inputs), seed)
    return {name: family.inputs(z, limits) for name, (family, z) in points.items()}


def reference_points(inputs: int, seed: int) -> Mapping[str, tuple[Family, Array]]:
    """Return `references` as points (amplitudes, inputs times size of the family) of families."""
    centred = np.full(len(AMPLITUDES), 0.5)
    sweep = np.column_stack([AMPLITUDES, centred, np.zeros_like(centred), np.ones_like(centred)])
    rng = np.random.default_rng([seed, 1])
    own = [np.tile(rng.random(20), (len(AMPLITUDES), 1)) for _ in range(inputs)]
    held = [np.column_stack([AMPLITUDES, centred, levels]) for levels in own]
    return {
        "chirp": (CHIRP, np.tile(sweep, (1, inputs))),
        "random": (Family("random levels", 22, _holds), np.concatenate(held, axis=1)),
    }
