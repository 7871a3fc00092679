"""Closed form of a force that a network has learned, as a formula of position and velocity.

Section 4.4.5 reads a spring law and friction off the network's surface by eye; chapter 6 proposes symbolic
regression. Here a formula is a sum of few terms with a physical name, found by best-subset least squares. The
number of terms is chosen by cross-validation: the shortest formula whose squared error on held-out
experiments is within one standard error of the best (Hastie, Tibshirani and Friedman, The Elements of
Statistical Learning, 7.10).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from unmodelled.base.arrays import Array, Indices
from unmodelled.base.errors import BadInput
from unmodelled.effects.formula_candidates import (
    Motion,
    Term,
    candidates,
    columns_of,
    compatible,
    short_number,
    sum_text,
)

FEWEST, LARGEST = 50, 6  # samples; terms
_WORTH = 0.002  # of the force's range: a gain (rms) below it is not worth a term, a network is no more exact
_DIGITS = 1e-4  # of the largest force: a gain below it is lost where the coefficients are rounded
_FOLDS, _BLOCKS = 10, 5  # of experiments; of consecutive samples where there are fewer than three experiments
_JUMPS = (0.0, *np.geomspace(3e-4, 0.3, 13))  # of dry friction, in shares of the top speed; 0: sign
_FADES = tuple(np.geomspace(3e-3, 0.5, 16))  # of the Stribeck peak, likewise
_KEPT = 16  # sets of each size that are extended by one more term
_RIDGE = 1e-9  # for columns of rms 1: keeps near-parallel ones from cancelling each other


@dataclass(frozen=True)
class ClosedForm:
    """Formula of a force (in N; in N m if the position is an angle)."""

    text: str  # in the grammar of a system file; "0" if no term helps
    coefficients: dict[str, float]  # by the text of the term, four significant digits; "1" is the constant
    terms: tuple[Term, ...]  # in the same order
    rmse: float  # difference to the network on the data, N

    def __call__(self, position: Array, velocity: Array) -> Array:
        """Return the force of the formula, of the shape to which the arguments broadcast."""
        x, v = np.broadcast_arrays(np.asarray(position, np.float64), np.asarray(velocity, np.float64))
        force: Array = columns_of(self.terms, x, v) @ np.array([*self.coefficients.values()])
        return force


def closed_form(
    position: Array,
    velocity: Array,
    force: Array,
    experiment: Indices,
    names: tuple[str, str],
    angle: bool = False,
) -> ClosedForm:
    """Find the shortest formula of the force (n,) of a network at positions (n,) and velocities (n,).

    A network smooths the jump of dry friction: the velocity scale in tanh(v/...) is that of the network, and
    the machine's can be smaller.
    """
    x, v, f = (np.asarray(a, dtype=np.float64) for a in (position, velocity, force))
    _check(dict(zip((*names, "force", "experiment"), (x, v, f, np.asarray(experiment)), strict=True)))
    search = _Search(x, v, f, _folds(np.asarray(experiment)), angle)
    squares = search.held_out()
    size = _shortest(squares, max(_WORTH * float(np.ptp(f)), _DIGITS * float(np.abs(f).max())))
    terms = _refined(search.best()[size], x, v, f)
    values = np.array([float(short_number(c)) for c in _fitted(terms, x, v, f)[0]])
    coefficients = {term.text(*names): float(c) for term, c in zip(terms, values, strict=True)}
    rmse = float(np.sqrt(np.mean((columns_of(terms, x, v) @ values - f) ** 2)))
    return ClosedForm(sum_text(coefficients), coefficients, terms, rmse)


def _check(arrays: dict[str, Array]) -> None:
    shapes = {a.shape for a in arrays.values()}
    if len(shapes) != 1 or len(next(iter(shapes))) != 1:
        said = ", ".join(f"{name} {a.shape}" for name, a in arrays.items())
        raise ValueError(f"a closed form takes four arrays of one length, got {said}")
    for name, a in arrays.items():
        if len(a) < FEWEST:
            raise BadInput(f"a closed form needs at least {FEWEST} samples, got {len(a)}: give more data")
        if not np.isfinite(a).all():
            first = int(np.argmin(np.isfinite(a))) + 1
            raise BadInput(f"closed form: sample {first} of {name} is not finite: leave it out")


def _folds(experiment: Indices) -> Indices:
    """Return the number of the cross-validation fold of each sample."""
    ids, number_of = np.unique(experiment, return_inverse=True)
    if len(ids) < 3:
        return np.arange(len(experiment)) * _BLOCKS // len(experiment)
    return number_of % _FOLDS


def _shortest(squares: Array, worth: float) -> int:
    """Return the size of the shortest formula as good as the best one; held-out `squares` (folds, sizes)."""
    mean = squares.mean(axis=0)
    best = int(np.argmin(mean))
    margin = max(squares[:, best].std(ddof=1) / np.sqrt(len(squares)), worth**2)
    return int(np.argmax(mean <= mean[best] + margin))


@dataclass(frozen=True)
class _Fit:
    """Columns of a library and their `weights`: minus the coefficient of each column, 1 for the force."""

    library: int
    columns: tuple[int, ...]
    weights: Array
    squares: float


class _Search:
    """Best-subset least squares on folds of the data.

    There is one library of candidates per velocity scale of dry friction. Only the sums of products of its
    columns are kept, scaled to rms 1 and with the force as the last column: (folds, columns, columns).
    """

    def __init__(self, x: Array, v: Array, force: Array, fold: Indices, angle: bool) -> None:
        """Search velocity scales on a grid first, then use those that suit the best formula of some size.

        Otherwise a second term would compensate for a velocity scale between two points of the grid.
        """
        self._data = x, v, force, fold, angle
        self._every = np.unique(fold)
        speed = float(np.quantile(np.abs(v), 0.99)) or 1.0
        self._prepare([speed * share for share in _JUMPS], [speed * share for share in _FADES])
        terms = [term for best in self.best() for term in _refined(best, x, v, force)]
        jumps = {t.jump for t in terms if t.motion in (Motion.DRY, Motion.PEAK)}
        self._prepare(sorted(jumps | {0.0}), sorted({t.fade for t in terms if t.fade}))

    def _prepare(self, jumps: Sequence[float], fades: Sequence[float]) -> None:
        x, v, force, fold, angle = self._data
        turns = angle and bool(np.ptp(x) >= 2 * np.pi)
        parts = [fold == part for part in self._every]
        self._counts = np.array([part.sum() for part in parts])
        self._libraries = [candidates(jump, fades, angle, turns) for jump in jumps]
        self._products = []
        for library in self._libraries:
            columns = np.column_stack([columns_of(library, x, v), force])
            columns[:, :-1] /= _lengths(columns[:, :-1]) / np.sqrt(len(x))
            self._products.append(np.array([columns[part].T @ columns[part] for part in parts]))

    def best(self) -> list[tuple[Term, ...]]:
        """Return the best formula of 0, 1, ... terms."""
        fits = self._fits(self._every)
        return [tuple(self._libraries[fit.library][k] for k in fit.columns) for fit in fits]

    def held_out(self) -> Array:
        """Return mean squared errors (folds, sizes) of formulas on the folds that they were not fitted to."""
        errors = []
        for part in self._every:
            fits = self._fits(self._every[self._every != part])
            products = [self._products[fit.library][part] for fit in fits]
            errors.append([fit.weights @ p @ fit.weights for fit, p in zip(fits, products, strict=True)])
        squares: Array = np.maximum(errors, 0.0) / self._counts[:, None]
        return squares

    def _fits(self, parts: Indices) -> list[_Fit]:
        """Return the best formula of each size on some folds of the data."""
        found = [self._extended(k, parts) for k in range(len(self._libraries))]
        return [min(fits, key=lambda fit: fit.squares) for fits in zip(*found, strict=True)]

    def _extended(self, number_of: int, parts: Indices) -> list[_Fit]:
        """Return the best formula of each size in one library, by extending the best smaller ones."""
        library, products = self._libraries[number_of], self._products[number_of][parts].sum(axis=0)
        ridge = _RIDGE * self._counts[parts].sum()
        kept: list[tuple[int, ...]] = [()]
        empty = np.append(np.zeros(len(library)), 1.0)
        best = [_Fit(number_of, (), empty, float(products[-1, -1]))]
        for size in range(1, LARGEST + 1):
            wider = {tuple(sorted({*columns, k})) for columns in kept for k in range(len(library))}
            sets = sorted(s for s in wider if len(s) == size and compatible([library[k] for k in s]))
            squares, weights = _solved(products, np.array(sets), ridge)
            order = np.argsort(squares, kind="stable")[:_KEPT]
            kept = [sets[i] for i in order]
            best.append(_Fit(number_of, kept[0], weights[order[0]], float(squares[order[0]])))
        return best


def _solved(products: Array, sets: Indices, ridge: float) -> tuple[Array, Array]:
    """Return squared errors (m,) and weights (m, columns) of least squares on `sets` (m, size) of columns."""
    gram = products[sets[:, :, None], sets[:, None, :]] + ridge * np.eye(sets.shape[1])
    coefficients = np.linalg.solve(gram, products[sets, -1][..., None])[..., 0]
    weights = np.zeros((len(sets), len(products)))
    np.put_along_axis(weights, sets, -coefficients, axis=1)
    weights[:, -1] = 1.0
    return ((weights @ products) * weights).sum(axis=1), weights


def _lengths(columns: Array) -> Array:
    lengths: Array = np.linalg.norm(columns, axis=0)
    return np.where(lengths > 0.0, lengths, 1.0)


def _fitted(terms: Sequence[Term], x: Array, v: Array, force: Array) -> tuple[Array, float]:
    """Return the coefficients by least squares, and the sum of squared errors."""
    columns = columns_of(terms, x, v)
    lengths = _lengths(columns)
    scaled = np.linalg.lstsq(columns / lengths, force)[0]
    return scaled / lengths, float(np.sum((columns / lengths @ scaled - force) ** 2))


def _refined(terms: tuple[Term, ...], x: Array, v: Array, force: Array) -> tuple[Term, ...]:
    """Return the terms with the velocity scales that fit best, rounded to three digits."""
    start = np.array([max((getattr(term, name) for term in terms), default=0.0) for name in ("jump", "fade")])
    free = start > 0.0
    if not free.any():
        return terms

    def shaped(factors: Array) -> tuple[Term, ...]:
        speeds = start.copy()
        speeds[free] *= np.exp(factors)
        return tuple(term.shaped(*speeds) for term in terms)

    simplex = np.vstack([np.zeros(free.sum()), 0.2 * np.eye(free.sum())])
    options = {"initial_simplex": simplex, "xatol": 1e-3, "fatol": 1e-9 * float(force @ force)}
    found = minimize(
        lambda factors: _fitted(shaped(factors), x, v, force)[1],
        simplex[0],
        method="Nelder-Mead",
        options=options,
    )
    return tuple(t.shaped(float(f"{t.jump:.3g}"), float(f"{t.fade:.3g}")) for t in shaped(found.x))
