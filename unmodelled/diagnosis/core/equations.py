"""The linear system: products of all columns experiment by experiment, eliminations, left-out errors.

Start states are eliminated window by window, deviations of single experiments from the mean experiment by
experiment (mixed model equations, Henderson 1950; Laird and Ware 1982), numbers that every model leaves open
fold by fold. Two matrices of a fold remain: one fits any subset of the atoms (Furnival and Wilson 1974), the
other scores it on the experiment that was left out (in the manner of PRESS, Allen 1974). Amplitudes have a
ridge of their plausible sizes (Hoerl and Kennard 1970).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from unmodelled.base.arrays import Array, Indices, Mask, Single
from unmodelled.diagnosis.core.columns import Atom, Columns, at_level
from unmodelled.diagnosis.core.folds import PRIOR, Folds, without_open
from unmodelled.diagnosis.core.left_out_kernels import without_starts
from unmodelled.diagnosis.data.levels import levels
from unmodelled.systems.model import System

#: Shapes that are kept of a law at a place, and laws that are kept at a level of a factor: budgets.
KEPT, LOCAL = 2, 24
#: Product below which a column does not act.
NOTHING = 1e-9


@dataclass(frozen=True, eq=False)
class Equations:
    """Products of all columns, with start states eliminated, in units of independent samples.

    Order of the columns: open, between, atoms, measured error.
    """

    gram: Array  # products, (experiments, columns, columns)
    open: int  # number of columns that every model leaves open
    between: tuple[Atom | None, ...]  # differences between experiments; None where one is only there
    prior: Array  # plausible deviations of both, (open + between,)
    atoms: tuple[Atom, ...]
    first: Indices  # first column of every atom among those of all atoms, (atoms,)
    count: Indices  # columns of every atom, (atoms,)
    positive: Mask  # columns of atoms that cannot be negative, (columns of atoms,)
    samples: Array  # independent samples of every experiment, (experiments,)
    system: System
    there: frozenset[str]  # families of the effects that the path has already

    @classmethod
    def of(cls, columns: Columns) -> Equations:
        """Make all columns, keep the best shapes of every law at a place, and multiply them."""
        starts, always, runs, share, prior = _always(columns)
        look = _FirstLook.of(always, runs, len(columns.open.prior), prior, share)
        atoms, kept = list[Atom](), list[Single]()
        for several, raw in columns.atoms():
            for k, block in look.best(starts.free(raw), len(several)):
                atoms.append(several[k])
                kept.append(block.astype(np.float32))  # all columns at once take most of the memory
        gram, samples = _products(columns, always, kept, runs, share)
        own = cls._of(gram, columns, prior, atoms, samples)
        return own._with_levels(columns)

    @classmethod
    def plain(cls, columns: Columns, further: Array) -> Equations:
        """Multiply columns (windows, K, outputs, N), each of which may come alone; every sample counts."""
        starts, always, runs, _, prior = _always(columns)
        gram, samples = _products(columns, always, [starts.free(further)], runs, 1.0)
        own, one = cls._of(gram, columns, prior, (), samples), np.ones(further.shape[3], np.int64)
        return replace(own, first=np.cumsum(one) - 1, count=one, positive=one < 0)

    @classmethod
    def _of(
        cls, gram: Array, columns: Columns, prior: Array, atoms: Sequence[Atom], samples: Array
    ) -> Equations:
        count = np.array([len(a.scale) for a in atoms], np.int64)
        positive = np.concatenate([np.empty(0, bool), *(a.positive for a in atoms)])
        between, open_ = columns.between.atoms, len(columns.open.prior)
        there = frozenset(e.family for e in columns.path.hypothesis.effects)
        return cls(
            *(gram, open_, between, prior, tuple(atoms), np.cumsum(count) - count, count, positive),
            *(samples, columns.path.hypothesis.study.system, there),
        )

    def _with_levels(self, columns: Columns) -> Equations:
        """Add the best laws at levels of factors: their products are those of all experiments, or zero."""
        study, runs = columns.path.hypothesis.study, np.unique(columns.path.owner)
        every = np.ones(len(runs), bool)
        wanted = [(k, atom, every) for k, atom in enumerate(self.atoms) if not atom.effect.at_levels]
        best = dict[object, int]()
        for k, atom in enumerate(self.atoms):
            if atom.effect.at_levels or atom.place.kind == "port":
                best.setdefault((atom.key, *(atom.shape.values() if atom.effect.at_levels else ())), k)
        alone, _, _ = self._without_between(np.arange(len(self.between)), 1.0)
        for factor, level, members in levels(study.logs.experiments.iloc[runs], study.thresholds):
            here = np.isin(np.arange(len(runs)), members)
            gains = self._gains_at(alone, here)
            few = sorted(best.values(), key=gains.__getitem__, reverse=True)[:LOCAL]
            wanted += [(k, at_level(self.atoms[k], factor, level), here) for k in few]
        own = [np.arange(self.first[k], self.first[k] + self.count[k]) for k, _, _ in wanted]
        n, always = len(self.prior), np.ones((len(runs), len(self.prior)), bool)
        index = np.concatenate([np.arange(n), *(n + one for one in own), [self.gram.shape[1] - 1]], dtype=int)
        masks = [np.repeat(here[:, None], self.count[k], axis=1) for k, _, here in wanted]
        mask = np.concatenate([always, *masks, every[:, None]], axis=1)
        gram = self.gram[:, index[:, None], index] * (mask[:, :, None] & mask[:, None])
        return self._of(gram, columns, self.prior, [atom for _, atom, _ in wanted], self.samples)

    def _gains_at(self, alone: Array, here: Mask) -> list[float]:
        """Squared error (atoms,) that every law alone removes, if it acts in some experiments only."""
        n, total, every = self.open, alone[here].sum(0), alone.sum(0)
        total[:n, :n] = every[:n, :n]
        total[:n, -1] = total[-1, :n] = every[:n, -1]
        fit, _ = without_open(total, total, n, self.prior[:n])
        own = [slice(first, first + count) for first, count in zip(self.first, self.count, strict=True)]
        return [float(fit[k, -1] @ np.linalg.solve(fit[k, k], fit[k, -1])) for k in own]

    def _without_between(self, on: Indices, unit: float) -> tuple[Array, Array, Array]:
        """Products (experiments, rest, rest) without differences, their fits, and inverse curvatures."""
        own, many = self.open + on, self.open + len(self.between)
        rest = np.r_[0 : self.open, many : self.gram.shape[1]]
        cross, square = self.gram[:, own[:, None], rest], self.gram[:, own[:, None], own]
        inverse = np.asarray(np.linalg.inv(square + unit * np.diag(self.prior[own] ** -2.0)), np.float64)
        moved = inverse @ cross
        return self.gram[:, rest[:, None], rest] - cross.transpose(0, 2, 1) @ moved, moved, inverse

    def only(self, atoms: Sequence[int]) -> Equations:
        """Return the equations with some of the atoms."""
        n, some = len(self.prior), list(atoms)
        index = np.array(
            [k for a in some for k in range(self.first[a], self.first[a] + self.count[a])], np.int64
        )
        own = np.concatenate([np.arange(n), n + index, [self.gram.shape[1] - 1]])
        count = self.count[some]
        return replace(
            self,
            gram=self.gram[:, own[:, None], own],
            atoms=tuple(self.atoms[a] for a in some),
            count=count,
            first=np.cumsum(count) - count,
            positive=self.positive[index],
        )

    def folds(self, between: Mask | None = None, unit: float = 1.0) -> Folds:
        """Eliminate what belongs to single experiments and what is open; return fit and score of every fold.

        Only differences of the mask `between` (between,) are there. Deviations of the experiments are free
        but for their priors; their sum is about as small as one of them. (A sum of exactly zero charges
        scatter eight times, no constraint hides a common gain.)
        """
        n, on = self.open, np.arange(len(self.between)) if between is None else np.flatnonzero(between)
        own = n + on
        alone, moved, inverse = self._without_between(on, unit)
        one = np.diag(self.prior[own] ** 2) / unit

        def eliminated(total: Array, shift: Array, free: Array) -> Array:
            return total + shift.T @ np.linalg.solve(free + one, shift) if len(own) else total

        sums = alone.sum(0), moved.sum(0), inverse.sum(0)
        every = eliminated(*sums)
        fits, scores = [], []
        for left in range(len(self.gram)):
            train = eliminated(sums[0] - alone[left], sums[1] - moved[left], sums[2] - inverse[left])
            fit, score = without_open(train, every - train, n, self.prior[:n])
            fits.append(fit)
            scores.append(score)
        whole, _ = without_open(every, every, n, self.prior[:n])
        square = self.gram[:, own[:, None], own]
        size = np.eye(len(own)) + square * np.outer(self.prior[own], self.prior[own]) / unit
        price = np.linalg.slogdet(size)[1] if len(own) else np.zeros(len(self.gram))
        return Folds(np.array(fits), np.array(scores), whole, self.first, self.count, self.positive, price)


@dataclass(frozen=True, eq=False)
class _Starts:
    """Elimination of the start states: each window has its own, with the noise of the sensors as prior."""

    root: Array
    S: Array
    inverse: Array

    @classmethod
    def of(cls, columns: Columns) -> _Starts:
        root, raw = columns.path.root, columns.starts
        S = _flat(raw * root[..., None])  # no column where no output shows a state
        inverse = np.asarray(np.linalg.inv(S.transpose(0, 2, 1) @ S + np.eye(S.shape[2])), np.float64)
        return cls(root, S, inverse)

    def free(self, columns: Array) -> Array:
        """Weighted columns (windows, rows, N) whose products are those after the elimination."""
        found: Array = without_starts(np.ascontiguousarray(columns), self.root, self.S, self.inverse)
        return found


@dataclass(frozen=True, eq=False)
class _FirstLook:
    """A law alone beside all that is always there: its best shapes."""

    runs: list[Mask]
    base: list[Array]
    inverse: list[Array]
    share: float
    open: int
    prior: Array

    @classmethod
    def of(cls, always: Array, runs: list[Mask], open_: int, prior: Array, share: float) -> _FirstLook:
        base = [always[run].reshape(-1, always.shape[2]) for run in runs]
        own = [each[:, open_ : len(prior)] for each in base]
        spread = np.diag(prior[open_:] ** -2.0)
        inverse = [np.asarray(np.linalg.inv(share * (D.T @ D) + spread), np.float64) for D in own]
        return cls(runs, base, inverse, share, open_, prior)

    def best(self, Z: Array, shapes: int) -> list[tuple[int, Array]]:
        """Numbers and columns (windows, rows, amplitudes) of the shapes that lower the error most."""
        n, m, N = self.open, len(self.prior), Z.shape[2]
        total = np.zeros((n + 1 + N, n + 1 + N))
        for run, base, inverse in zip(self.runs, self.base, self.inverse, strict=True):
            X = np.concatenate([base[:, :n], base[:, m:], Z[run].reshape(-1, N)], axis=1)
            cross = self.share * (base[:, n:m].T @ X)
            total += self.share * (X.T @ X) - cross.T @ inverse @ cross
        a, gains, sizes = N // shapes, np.zeros(shapes), np.diag(total)[n + 1 :].reshape(shapes, -1).sum(1)
        for k in range(shapes):
            index = np.r_[0:n, n + 1 + a * k : n + 1 + a * (k + 1)]
            prior = np.r_[self.prior[:n], np.full(a, PRIOR)]
            fit = np.linalg.solve(total[np.ix_(index, index)] + np.diag(prior**-2.0), total[index, n])
            gains[k] = total[index, n] @ fit
        acting = [k for k in np.argsort(-gains).tolist() if sizes[k] > NOTHING]
        return [(k, Z[:, :, a * k : a * (k + 1)]) for k in acting[:KEPT]]


def _always(columns: Columns) -> tuple[_Starts, Array, list[Mask], float, Array]:
    """Elimination of start states, columns of all models, windows of experiments, share of a sample, priors.

    Errors of a free run change slowly: all samples of a window tell about as much as one.
    """
    path, starts = columns.path, _Starts.of(columns)
    every = [columns.open.columns, columns.between.columns, path.error[..., None]]
    owner = path.owner[path.judged]
    runs = [owner == i for i in np.unique(owner)]
    prior = np.concatenate([columns.open.prior, columns.between.prior])
    share = 1.0 / float(np.mean(path.recording.steps[path.judged]))
    return starts, starts.free(np.concatenate(every, axis=3)), runs, share, prior


def _products(
    columns: Columns,
    always: Array,
    further: Sequence[Single | Array],
    runs: Sequence[Mask],
    share: float,
) -> tuple[Array, Array]:
    """Products and independent samples of every experiment."""
    root, every, gram = columns.path.root, (always[..., :-1], *further, always[..., -1:]), []
    for run in runs:
        part = np.concatenate([block[run] for block in every], axis=2, dtype=np.float64)
        flat = part.reshape(-1, part.shape[2])
        gram.append(share * (flat.T @ flat))
    return np.stack(gram), np.array([share * float((root[run] > 0).sum()) for run in runs])


def _flat(columns: Array) -> Array:
    """Columns (windows, K, outputs, N) as (windows, K * outputs, N)."""
    windows, samples, outputs, many = columns.shape
    return columns.reshape(windows, samples * outputs, many)
