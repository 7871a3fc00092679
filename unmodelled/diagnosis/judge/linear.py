"""A fit linearised with everything that is open around it, and the evidence of columns that are added.

A residual counts as 1 / (its correlation time) samples. Starts of windows are eliminated window by window,
deviations of experiments (random effects, Laird and Ware 1982) experiment by experiment, and the numbers that
all experiments share at last. What is eliminated is integrated out: the determinant of its precision is a
price (Laplace's approximation), so that freedom which the logs do not need costs nothing and gains nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from unmodelled.base.arrays import Array, Indices, Mask
from unmodelled.diagnosis.core.columns import Columns
from unmodelled.diagnosis.core.path import Path
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis
from unmodelled.diagnosis.judge.weights import Weights

#: Sizes of the deviations of experiments, in their plausible size of 10 %: the likeliest of these counts.
SIGMAS = 0.03, 0.1, 0.3, 1.0
#: Standard deviation of open numbers and of starts of windows, in their plausible sizes.
OPEN, START = 3.0, 3.0
#: The same of a number of an experiment that has no prior, and of a number at an end of its bounds.
FREE, NOWHERE = 10.0, 1e-6
#: Standard errors up to which the mean of deviations is chance.
CHANCE = 2.0


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
class Linearised:
    """A fit with everything that is open around it."""

    fitted: FittedHypothesis
    columns: Columns
    weights: Weights
    tau: float  # by which priors of the fit are tighter than those of independent samples

    @classmethod
    def of(cls, fitted: FittedHypothesis, tau: float, weights: Weights | None = None) -> Linearised:
        """Linearise a fit around the path of its windows; the weights are its own unless some are given."""
        path = Path.of_windows(fitted, fitted.recording)
        return cls(fitted, Columns(path), weights or Weights.of(path), tau)

    @cached_property
    def runs(self) -> Indices:
        """Return the numbers, shape (experiments,), of the experiments."""
        return np.unique(self.columns.path.owner)

    @property
    def opened(self) -> int:
        """Return how many open numbers all experiments share."""
        return len(self.columns.open.prior)

    @cached_property
    def _base(self) -> Array:
        """Weighted columns [open | residual | of experiments], (windows, samples, N)."""
        columns = self.columns
        every = columns.open.columns, columns.path.error[..., None], columns.own.columns
        return self.weights.flat(np.concatenate(every, axis=3))

    @cached_property
    def _starts(self) -> tuple[Array, Array, Array]:
        """Columns of the starts of windows, inverse of their products with prior, and the step of `_base`."""
        S = self.weights.flat(self.columns.starts)
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
        at = [[values[u.name][i] / u.scale for u in numbers] + [0.0] * hidden for i in ids]
        unit = np.array(size + [1.0] * hidden)
        return unit, np.array(at).reshape(len(ids), len(unit)), np.array(known + [False] * hidden, np.bool_)

    @cached_property
    def _by_run(self) -> Array:
        """Products of `_base` by experiment, starts eliminated."""
        S, _, step = self._starts
        base = self._base
        return self._sums(base.swapaxes(1, 2) @ base - (S.swapaxes(1, 2) @ base).swapaxes(1, 2) @ step)

    @cached_property
    def _of_windows(self) -> Indices:
        """Places in `runs` of the windows' experiments, (windows,)."""
        return np.searchsorted(self.runs, self.columns.path.owner)

    @cached_property
    def _sorted(self) -> tuple[Indices, Indices]:
        """Windows by experiment, and the first of each in this order."""
        order = np.argsort(self._of_windows, kind="stable")
        return order, np.searchsorted(self._of_windows[order], np.arange(len(self.runs)))

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
        X = self.weights.flat(columns)
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

    def differing(self, column: Array, size: float) -> float:
        """Return the pooled evidence, nats, with a number that differs between experiments.

        Its column is (windows, K, outputs, 1), and `size` its plausible deviation in units of the column; the
        likeliest of some sizes counts.
        """
        return max(
            self.pooled(one, float(one.products[-1, -1]))
            for sigma, products in self.products(column).items()
            for one in (self._apart(sigma, products, size * share) for share in SIGMAS)
        )

    def _apart(self, sigma: float, products: Products, size: float) -> Reduced:
        """Products without their first column, which every experiment has for itself, and open numbers."""
        own, rest = products.each[:, 0], products.each[:, 1:, 1:]
        without = rest - own[:, 1:, None] * own[:, None, 1:] / (own[:, :1, None] + size**-2.0)
        price = products.price + 0.5 * np.log1p(size**2 * own[:, 0])
        return self.reduced({sigma: Products(without, price)})[sigma]

    @cached_property
    def _pooled(self) -> Mapping[float, float]:
        """Evidence of the fit by sigma, nats, all outputs alike."""
        return {s: self.pooled(one, one.products[-1, -1]) for s, one in self.reduced(self.bare).items()}

    @cached_property
    def bare(self) -> Mapping[float, Products]:
        """Return products of [open | residual] by sigma."""
        return self.products(np.empty((*self.columns.path.error.shape, 0)))

    @cached_property
    def normal(self) -> Array:
        """Return products (open + 1, open + 1) of [open | residual] with priors, of all experiments."""
        return np.asarray(self.bare[self.sigma].each.sum(axis=0) + self.prior)

    @cached_property
    def settled(self) -> tuple[Array, Array]:
        """Return squares (experiments, outputs) and penalties after a step of the open numbers: `after`."""
        return self.after(np.tile(newton_step(self.normal), (len(self.runs), 1)))

    @cached_property
    def squares(self) -> Array:
        """Return weighted mean squares (outputs,) where deviations of experiments have no mean beyond chance.

        What all experiments share is no deviation: a gain that is wrong in all of them is not explained by
        each having its own. The open numbers follow.
        """
        shared = np.tile(np.append(-newton_step(self.normal), 1.0), (len(self.runs), 1))
        own, (_, at, scaled) = self._moved(shared, self.sigma), self._own
        own = own - np.where(scaled, beyond_chance(at + own), 0.0)
        many = self.opened + 1
        chosen = np.zeros((len(own), self._by_run.shape[1], many))
        chosen[:, :many] = np.eye(many)
        chosen[:, many:, -1] = -own
        normal = np.einsum("rni,rnm,rmj->ij", chosen, self._by_run, chosen) + self.prior
        shared = np.tile(np.append(-newton_step(normal), 1.0), (len(self.runs), 1))
        return self._mean(self._left(shared, own)[0])

    @property
    def pooled_of_fit(self) -> float:
        """Return the evidence of the fit, nats, if all outputs are explained alike."""
        return self._pooled[self.sigma]

    def pooled(self, reduced: Reduced, square: float) -> float:
        """Return the evidence, nats, if all outputs are explained alike: it chooses shapes and sizes."""
        least = max(square, 1e-12 * float(reduced.products[-1, -1]))
        return self.likelihood(least, reduced.price)

    @property
    def sigma(self) -> float:
        """Return the likeliest size of the deviations of experiments, in their plausible size."""
        return max(self._pooled, key=lambda sigma: self._pooled[sigma])

    @property
    def varies(self) -> bool:
        """Return whether experiments deviate: the likeliest size pays for itself beside the smallest."""
        return self._pooled[self.sigma] - self._pooled[SIGMAS[0]] > self.weights.price(1)

    @cached_property
    def evidence(self) -> float:
        """Return the evidence of the fit, nats, up to a constant of the weights."""
        return self._evidence(newton_step(self.normal), self.settled, self.sigma)

    def evidence_with(self, added: Array, step: Array, sigma: float) -> float:
        """Return the evidence, nats, with a change `added` (windows, K, outputs) of outputs, in sensor noise.

        It is there beside a step (open,) of the open numbers.
        """
        change = self.weights.flat(-added[..., None])[..., 0]
        return self._evidence(step, self.after(np.tile(step, (len(self.runs), 1)), sigma, change), sigma)

    def _evidence(self, step: Array, after: tuple[Array, Array], sigma: float) -> float:
        """Evidence after a step of the open numbers; the noise of every output is unknown.

        Pooled, an output of which a law explains all would be hidden behind another one, of which there is
        nothing to explain.
        """
        squares, penalty = after
        moved = np.append(-step, 1.0)
        off = float(moved @ self.prior @ moved) + float(penalty.sum())
        price = float(self.bare[sigma].price.sum())
        return float(-0.5 * self.weights.each @ np.log(self._mean(squares)) - 0.5 * off - price)

    def _mean(self, squares: Array) -> Array:
        """Weighted mean squares (outputs,) of (experiments, outputs)."""
        return np.asarray(np.maximum(squares.sum(axis=0), 1e-300) / np.maximum(self.weights.each, 1e-300))

    def after(
        self, steps: Array, sigma: float | None = None, change: Array | None = None
    ) -> tuple[Array, Array]:
        """Return weighted squares (experiments, outputs) after steps (experiments, open) of the open numbers.

        A weighted `change` (windows, samples) is added to the residual. Starts and deviations follow, and the
        squares of both in their priors are the second array, (experiments,).
        """
        sigma = self.sigma if sigma is None else sigma
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
        """Weighted squares (experiments, outputs) with steps and a change, and steps of the starts."""
        S, _, started = self._starts
        every = np.concatenate([shared, -own], axis=1)[self._of_windows]
        start = np.einsum("wsn,wn->ws", started, every)
        left = np.einsum("wkn,wn->wk", self._base, every)
        if change is not None:
            start, left = start + self._started(change), left + change
        left = left - np.einsum("wks,ws->wk", S, start)
        squares = (left.reshape(len(left), -1, self.weights.root.shape[2]) ** 2).sum(axis=1)
        return self._sums(squares), np.asarray(start)

    def likelihood(self, square: float, price: float) -> float:
        """Return the log likelihood of a squared residual whose variance is unknown, less a price."""
        return -0.5 * self.weights.samples * float(np.log(max(square, 1e-300))) - price


def newton_step(products: Array) -> Array:
    """Return the step (open,) of the open numbers by products [open | residual]."""
    return np.asarray(np.linalg.solve(products[:-1, :-1], products[:-1, -1]))


def beyond_chance(deviations: Array) -> Array:
    """Return what of the means of deviations (experiments, N) is beyond `CHANCE` standard errors, (N,)."""
    mean, count = deviations.mean(axis=0), len(deviations)
    error = deviations.std(axis=0, ddof=1) / np.sqrt(count) if count > 1 else np.zeros_like(mean)
    return np.asarray(np.sign(mean) * np.maximum(np.abs(mean) - CHANCE * error, 0.0))
