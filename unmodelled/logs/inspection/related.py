"""Inputs that have nothing to do with the outputs, found without a model."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain, pairwise

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.logs.measurements import Measurements

#: Past intervals over which inputs are averaged, and samples of the longest one that are compared.
INTERVALS, COMPARED = 7, 20
#: Smallest number of parts of which one is predicted by the others; fewer runs are divided.
FEWEST_PARTS = 6
#: Random signals of which none may predict the outputs as well: a level of 5 %.
SURROGATES = 19
#: Ridge of the regression, in the mean square of its columns.
RIDGE = 1e-3


def surrogates(logs: Measurements) -> Iterator[Array]:
    """Yield inputs (samples, inputs) of random phases, with the spectra of all runs (Theiler et al. 1992)."""
    rng = np.random.default_rng(0)
    for _ in range(SURROGATES):
        yield np.concatenate([_surrogate(logs.u[logs.rows(i)], rng) for i in range(len(logs))])


def is_related(logs: Measurements, steps: int) -> bool:
    """Return whether inputs predict outputs of other runs better than random ones of their spectrum.

    Means of the inputs and of their magnitudes over past intervals predict outputs and their first and second
    increments by least squares. Inputs that are constant in every run are related: nothing tells.

    Takes steps, the samples of the longest interval.

    Examples:
        >>> from dataclasses import replace
        >>> import unmodelled as um
        >>> system, logs = um.example("pendulum")
        >>> noise = np.random.default_rng(0).standard_normal(logs.u.shape)
        >>> is_related(logs, 100), is_related(replace(logs, u=noise), 100)
        (True, False)
    """
    rows = [logs.rows(i) for i in range(len(logs))]
    if all(np.ptp(logs.u[run], axis=0).max(initial=0.0) == 0.0 for run in rows):
        return True
    tried = chain([logs.u], surrogates(logs))
    shown, *random = (_explained([(u[run], logs.y[run]) for run in rows], steps) for u in tried)
    return all(shown > each for each in random)


def _surrogate(u: Array, rng: np.random.Generator) -> Array:
    spectrum = np.fft.rfft(u, axis=0)
    turned = spectrum * np.exp(2j * np.pi * rng.uniform(size=(len(spectrum), 1)))
    return np.asarray(np.fft.irfft(np.concatenate([spectrum[:1], turned[1:]]), len(u), axis=0))


def _explained(runs: Sequence[tuple[Array, Array]], steps: int) -> float:
    """Share of the best output, or of its increments, that inputs explain in the median left-out part."""
    step = max(1, steps // COMPARED)
    pieces = -(-FEWEST_PARTS // len(runs))
    parts: list[tuple[Array, Array]] = []
    for u, y in runs:
        moved = _increment(y, step)
        pair = _past(u, steps), np.concatenate([y, moved, _increment(moved, step)], axis=1)
        columns, targets = (v - v.mean(axis=0) for v in pair)
        parts += zip(*(np.array_split(v[::step], pieces) for v in (columns, targets)), strict=True)
    sizes = [np.concatenate(v).std(axis=0) for v in zip(*parts, strict=True)]
    X, Y = ([p[k][:, size > 0.0] / size[size > 0.0] for p in parts] for k, size in enumerate(sizes))
    gram, cross = np.array([x.T @ x for x in X]), np.array([x.T @ y for x, y in zip(X, Y, strict=True)])
    left = []
    for k, (x, y) in enumerate(zip(X, Y, strict=True)):
        train = gram.sum(0) - gram[k]
        ridge = RIDGE * np.trace(train) / max(len(train), 1) * np.eye(len(train))
        error = y - x @ np.linalg.solve(train + ridge, cross.sum(0) - cross[k])
        left.append((error**2).sum(0) / np.maximum((y**2).sum(0), np.finfo(float).tiny))
    return float(1.0 - np.median(left, axis=0).min(initial=1.0))


def _increment(y: Array, step: int) -> Array:
    """Increments (samples, outputs) over some samples, 0 before."""
    return np.concatenate([np.zeros_like(y[:step]), y[step:] - y[:-step]])


def _past(u: Array, steps: int) -> Array:
    """Means (samples, columns) of inputs (samples, inputs) and of their magnitudes over past intervals."""
    values = np.concatenate([u, np.abs(u)], axis=1)
    total, now = np.cumsum(np.vstack([np.zeros(values.shape[1]), values]), axis=0), np.arange(len(u)) + 1
    edges = np.unique(np.concatenate([[0], np.geomspace(1, max(steps, 2), INTERVALS).astype(np.int64)]))
    means = [
        (total[np.maximum(now - a, 0)] - total[np.maximum(now - b, 0)]) / (b - a) for a, b in pairwise(edges)
    ]
    return np.concatenate(means, axis=1)
