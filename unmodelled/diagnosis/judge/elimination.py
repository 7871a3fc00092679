"""A fit linearised, and everything that is open around it eliminated.

Starts of windows are eliminated window by window, deviations of experiments (random effects, Laird and Ware
1982) experiment by experiment, and the numbers that all experiments share at last.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from unmodelled.base.arrays import Array, Indices, Mask
from unmodelled.diagnosis.columns.columns import Columns
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis
from unmodelled.diagnosis.judge.tails import scale, shares
from unmodelled.diagnosis.judge.weights import Weights

#: Sizes of the deviations of experiments, in their plausible size of 10 %: the likeliest of these counts.
SIGMAS = 0.03, 0.1, 0.3, 1.0
#: Standard deviation of open numbers and of starts of windows, in their plausible sizes.
OPEN, START = 3.0, 3.0
#: The same of a number of an experiment that has no prior, and of a number at an end of its bounds.
FREE, NOWHERE = 10.0, 1e-6


@dataclass(frozen=True, eq=False)
class Products:
    """Products of [columns | residual] by experiment, starts and deviations eliminated, at one sigma."""

    each: Array  # (experiments, N + 1, N + 1)
    price: Array  # nats that the deviations cost, (experiments,)


class Reduced(NamedTuple):
    """Products of N columns and of the residual when all that is open has followed."""

    products: Array  # (N + 1, N + 1)
    steps: Array  # of the open numbers by column and by the residual, (open, N + 1)
    price: float  # nats that deviations cost


@dataclass(frozen=True, eq=False)
class Elimination:
    """Products of columns and residuals of a fit, without what is open around it."""

    fitted: FittedHypothesis
    columns: Columns
    weights: Weights
    tau: float  # by which priors of the fit are tighter than those of independent samples

    @cached_property
    def runs(self) -> Indices:
        """Return the numbers, shape (experiments,), of the experiments."""
        return np.unique(self.columns.path.owner)

    @property
    def opened(self) -> int:
        """Return how many open numbers all experiments share."""
        return len(self.columns.open.prior)

    @cached_property
    def counts(self) -> Array:
        """Return how much windows count in steps, (windows, outputs), by what this fit leaves in them."""
        weighted = self.columns.path.error[:, self.weights.rows] * self.weights.root
        squares, samples = (weighted**2).sum(axis=1), self.weights.each
        return shares(squares, samples, scale(squares, samples))

    def _flat(self, columns: Array) -> Array:
        """Weighted columns (windows, samples, N) of (windows, K, outputs, N), as much as windows count."""
        return self.weights.flat(columns * np.sqrt(self.counts)[:, None, :, None])

    @cached_property
    def _base(self) -> Array:
        """Weighted columns [open | residual | of experiments], (windows, samples, N)."""
        columns = self.columns
        every = columns.open.columns, columns.path.error[..., None], columns.own.columns
        return self._flat(np.concatenate(every, axis=3))

    @cached_property
    def _starts(self) -> tuple[Array, Array, Array]:
        """Columns of the starts of windows, inverse of their products with prior, and the step of `_base`."""
        S = self._flat(self.columns.starts)
        inverse = np.asarray(np.linalg.inv(S.swapaxes(1, 2) @ S + np.eye(S.shape[2]) / START**2), float)
        return S, inverse, inverse @ (S.swapaxes(1, 2) @ self._base)

    @cached_property
    def _own(self) -> tuple[Array, Array, Mask]:
        """Plausible deviations and values of numbers of experiments, and those that sigma scales."""
        numbers = self.columns.unknowns(own=True)
        hidden = len(self.columns.own.prior) - len(numbers)
        known = [np.isfinite(u.prior) for u in numbers]
        size = [
            u.prior * np.sqrt(self.tau) / u.scale if yes else FREE
            for u, yes in zip(numbers, known, strict=True)
        ]
        ids, values = [self.columns.path.recording.logs.ids[i] for i in self.runs], self.fitted.fit.own
        at = np.array([[values[u.name][i] / u.scale for u in numbers] for i in ids]).reshape(len(ids), -1)
        unit = np.array(size + [1.0] * hidden)
        return unit, np.hstack([at, self._begun]), np.array(known + [False] * hidden, np.bool_)

    @cached_property
    def _begun(self) -> Array:
        """How far hidden states start from where they are expected, (experiments, hidden), as they vary."""
        path = self.columns.path
        starts = self._sums(self.fitted.fit.start[:, len(path.measured) :])
        spread = path.x[..., path.hidden].std(axis=(0, 1))
        return np.asarray(np.divide(starts, spread, out=np.zeros_like(starts), where=spread > 0.0))

    @cached_property
    def _by_run(self) -> Array:
        """Products of `_base` by experiment, starts eliminated."""
        S, _, step = self._starts
        base = self._base
        return self._sums(base.swapaxes(1, 2) @ base - (S.swapaxes(1, 2) @ base).swapaxes(1, 2) @ step)

    @cached_property
    def of_windows(self) -> Indices:
        """Return the places in `runs` of the experiments of the windows, (windows,)."""
        return np.searchsorted(self.runs, self.columns.path.owner)

    @cached_property
    def _sorted(self) -> tuple[Indices, Indices]:
        """Windows by experiment, and the first of each in this order."""
        order = np.argsort(self.of_windows, kind="stable")
        return order, np.searchsorted(self.of_windows[order], np.arange(len(self.runs)))

    def _sums(self, each: Array) -> Array:
        """Sums over the windows of every experiment."""
        order, first = self._sorted
        return np.asarray(np.add.reduceat(each[order], first, axis=0))

    @cached_property
    def _eliminated(self) -> Mapping[float, tuple[Array, Array, Products]]:
        """By sigma: inverse precision of deviations, their step, and products of [open | residual]."""
        M, many = self._by_run, self.opened + 1
        unit, at, scaled = self._own
        found = {}
        for sigma in SIGMAS:
            size = unit * np.where(scaled, sigma, 1.0)
            part, cross, square = M[:, :many, :many].copy(), M[:, many:, :many].copy(), M[:, many:, many:]
            part[:, -1, -1] += np.sum((at / size) ** 2, axis=1)
            cross[:, :, -1] -= at / size**2
            inverse = np.asarray(np.linalg.inv(square + np.diag(size**-2.0)), float)
            price = 0.5 * np.linalg.slogdet(np.eye(len(size)) + square * np.outer(size, size))[1]
            step = inverse @ cross
            found[sigma] = inverse, step, Products(part - cross.swapaxes(1, 2) @ step, price)
        return found

    @cached_property
    def prior(self) -> Array:
        """Return products (open + 1, open + 1) of the priors of open numbers, about zero for the chain.

        A number at an end of its bounds stays there.
        """
        numbers, values = self.columns.unknowns(own=False), self.fitted.fit.values
        chain = np.array([np.isfinite(u.prior) for u in numbers], np.bool_)
        own = np.array([u.prior * np.sqrt(self.tau) / u.scale for u in numbers])
        size = np.minimum(self.columns.open.prior * OPEN, own)
        at = np.array([values[u.name] / u.scale if c else 0.0 for u, c in zip(numbers, chain, strict=True)])
        found = np.diag(np.append(size**-2.0, np.sum((at / size) ** 2)))
        found[:-1, -1] = found[-1, :-1] = -at / size**2
        for k, unknown in enumerate(numbers):
            if self.fitted.at_bound(unknown.name):
                found[k, k], found[k, -1], found[-1, k] = NOWHERE**-2.0, 0.0, 0.0
        return found

    def products(self, columns: Array) -> Mapping[float, Products]:
        """Return products of [columns | open | residual] by sigma; columns (windows, K, outputs, N)."""
        X = self._flat(columns)
        S, inverse, step = self._starts
        T, TS = X.swapaxes(1, 2), X.swapaxes(1, 2) @ S
        XX = self._sums(T @ X - TS @ inverse @ TS.swapaxes(1, 2))
        XB = self._sums(T @ self._base - TS @ step)
        many, N, found = self.opened + 1, X.shape[2], {}
        for sigma, (left, own, rest) in self._eliminated.items():
            XZ = XB[:, :, many:]
            full = np.empty((len(XX), N + many, N + many))
            full[:, :N, :N] = XX - XZ @ left @ XZ.swapaxes(1, 2)
            full[:, :N, N:] = XB[:, :, :many] - XZ @ own
            full[:, N:, :N] = full[:, :N, N:].swapaxes(1, 2)
            full[:, N:, N:] = rest.each
            found[sigma] = Products(full, rest.price)
        return found

    def reduced(
        self, products: Mapping[float, Products], here: Mask | None = None
    ) -> Mapping[float, Reduced]:
        """Return products of columns and residual without open numbers by sigma.

        The columns are there in some experiments `here` (experiments,) only, in all of them unless given.
        """
        found = dict[float, Reduced]()
        for sigma, one in products.items():
            full, many = one.each.sum(axis=0), one.each.shape[1] - self.opened - 1
            if here is not None:
                full[:many] = one.each[here, :many].sum(axis=0)
                full[many:, :many] = full[:many, many:].T
            full[many:, many:] += self.prior
            kept = np.append(np.arange(many), many + self.opened)
            gone = many + np.arange(self.opened)
            left = np.linalg.solve(full[np.ix_(gone, gone)], full[np.ix_(gone, kept)])
            total = full[np.ix_(kept, kept)] - full[np.ix_(kept, gone)] @ left
            found[sigma] = Reduced(total, left, float(one.price.sum()))
        return found

    def after(self, steps: Array, sigma: float, change: Array | None = None) -> tuple[Array, Array]:
        """Return weighted squares (windows, outputs) after steps (experiments, open) of the open numbers.

        A weighted `change` (windows, samples) is added to the residual. Starts and deviations follow, and the
        squares of both in their priors are the second array, (experiments,).
        """
        unit, at, scaled = self._own
        shared = np.concatenate([-steps, np.ones((len(steps), 1))], axis=1)
        own = self._moved(shared, sigma, change)
        squares, start = self._left(shared, own, change)
        off = (at + own) / (unit * np.where(scaled, sigma, 1.0))
        return squares, self._sums(((start / START) ** 2).sum(axis=1)) + (off**2).sum(axis=1)

    def _moved(self, shared: Array, sigma: float, change: Array | None = None) -> Array:
        """Steps of the deviations, (experiments, N), beside [-step of open numbers | 1] `shared`."""
        inverse, moved, _ = self._eliminated[sigma]
        own = np.einsum("rij,rj->ri", moved, shared)
        if change is None:
            return np.asarray(own)
        S, _, _ = self._starts
        beyond = change - np.einsum("wks,ws->wk", S, self._started(change))
        deviations = self._sums(np.einsum("wkn,wk->wn", self._base[..., self.opened + 1 :], beyond))
        return np.asarray(own + np.einsum("rij,rj->ri", inverse, deviations))

    def _started(self, change: Array) -> Array:
        """Steps of the starts of windows, (windows, starts), after a weighted change (windows, samples)."""
        S, inverse, _ = self._starts
        return np.asarray(np.einsum("wsq,wq->ws", inverse, np.einsum("wkq,wk->wq", S, change)))

    def _left(self, shared: Array, own: Array, change: Array | None = None) -> tuple[Array, Array]:
        """Weighted squares (windows, outputs) with steps and a change, and steps of the starts."""
        S, _, started = self._starts
        every = np.concatenate([shared, -own], axis=1)[self.of_windows]
        start = np.einsum("wsn,wn->ws", started, every)
        left = np.einsum("wkn,wn->wk", self._base, every)
        if change is not None:
            start, left = start + self._started(change), left + change
        left = left - np.einsum("wks,ws->wk", S, start)
        squares = (left.reshape(len(left), -1, self.weights.root.shape[2]) ** 2).sum(axis=1)
        return np.asarray(squares / self.counts), np.asarray(start)


def newton_step(products: Array) -> Array:
    """Return the step (open,) of the open numbers by products [open | residual]."""
    return np.asarray(np.linalg.solve(products[:-1, :-1], products[:-1, -1]))
