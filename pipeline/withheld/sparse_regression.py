"""Sparse regression of accelerations as a reference: SINDy with the laws of the library as candidate terms.

Brunton, Proctor, Kutz: Discovering governing equations from data by sparse identification of nonlinear
dynamical systems, PNAS 113 (2016). It differentiates the measured speeds, subtracts the known physics and
looks for few terms that make up the rest.
"""

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
import sympy as sp
from sklearn.linear_model import LassoCV
from sklearn.model_selection import GroupKFold

from unmodelled.base.arrays import Array, Indices
from unmodelled.diagnosis.data.study import Study
from unmodelled.effects.added import Added
from unmodelled.effects.library import effects
from unmodelled.logs.differentiate import smooth_derivative
from unmodelled.systems.model import System, symbol
from unmodelled.systems.numeric import numpy_system_function

#: Samples that are regressed, about, and values of the shapes of one effect, at most.
SAMPLES, POINTS = 3000, 6
#: Of the cross-validation over experiments; penalties that are tried, and the least beside the largest.
FOLDS, ALPHAS, EPS = 4, 20, 1e-2
#: Of the rest: the least share of its mean square that the terms must explain, or there is no gap.
EXPLAINED = 0.02


@dataclass(frozen=True)
class Term:
    """Effect of the largest term."""

    family: str
    channel: str


def largest_term(study: Study) -> Term | None:
    """Return the effect of the term with the largest contribution; None if nothing remains to explain.

    A term is the influence of one unit of amplitude of a memoryless effect at a port or input on the rates of
    the velocities, with shapes on a grid. Uncertain parameters are fitted too, without penalty. The penalty
    of the terms is chosen by cross-validation over the training experiments (lasso).
    """
    problem = _Problem.of(study)
    columns = [(term, column) for term, column in problem.columns() if np.std(column) > 0.0]
    parameters = problem.parameters()
    matrix = _rest(np.stack([column for _, column in columns], axis=1), parameters)
    target = _rest(problem.target[:, None], parameters)[:, 0]
    size = np.sqrt(np.mean(matrix**2, axis=0))
    matrix = matrix / np.where(size > 0.0, size, 1.0)
    folds = GroupKFold(min(FOLDS, len(np.unique(problem.owner))))
    lasso = LassoCV(
        fit_intercept=False, cv=list(folds.split(matrix, groups=problem.owner)), eps=EPS, alphas=ALPHAS
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # nearly equal columns converge slowly, and it matters little
        lasso.fit(matrix, target)
    left = lasso.mse_path_.mean(axis=1).min()  # in the experiments of the other folds
    if left > (1.0 - EXPLAINED) * np.mean(target**2):
        return None
    return columns[int(np.argmax(np.abs(lasso.coef_)))][0]


def _rest(columns: Array, others: Array) -> Array:
    """Return the residual of columns, shape (samples, k), after regression on `others`, (samples, j)."""
    return np.asarray(columns - others @ np.linalg.lstsq(others, columns, rcond=None)[0])


@dataclass(frozen=True)
class _Problem:
    """Rates of the k velocities, each in units of its standard deviation, one after the other."""

    study: Study
    rows: Indices  # (n,), numbers of the used samples
    states: tuple[int, ...]  # numbers of the velocities
    scale: Array  # (k,), standard deviations of the rates
    owner: Indices  # (k n,), experiment of every rate
    target: Array  # (k n,), rates that the known physics does not explain

    @classmethod
    def of(cls, study: Study) -> "_Problem":
        system, logs = study.system, study.logs
        rows = np.flatnonzero(np.isin(logs.owner, study.learned))
        rows = rows[:: -(-len(rows) // SAMPLES)]
        driven = {*system.e, *system.u}
        states = tuple(k for k, rate in enumerate(system.dynamics) if rate.free_symbols & driven)
        rates = np.stack([smooth_derivative(logs.x[:, k], logs.offsets, logs.period)[1] for k in states])
        scale = np.std(rates, axis=1)
        owner = np.tile(logs.owner[rows], len(states))
        found = cls(study, rows, states, scale, owner, np.empty(0))
        known = found.values(system, [system.dynamics[k] for k in states])
        target = rates[:, rows] / scale[:, None] - known.T / scale[:, None]
        return cls(study, rows, states, scale, owner, target.ravel())

    def values(self, system: System, expressions: Sequence[sp.Expr], p: Array | None = None) -> Array:
        """(..., n, expressions) with the values of `system`, or p (..., parameters)."""
        logs, rows = self.study.logs, self.rows
        p = np.array(system.values) if p is None else p
        function = numpy_system_function(system, expressions, efforts_zero=True)
        c = logs.c[logs.owner[rows]]
        found = function(logs.t[rows], logs.x[rows], logs.u[rows], np.empty(0), p[..., None, :], c)
        return np.nan_to_num(found, posinf=0.0, neginf=0.0)

    def influence(self, symbols: Sequence[sp.Symbol]) -> Array:
        """(symbols, k n) by how much the rates rise with a parameter, an effort or an input."""
        system = self.study.system
        slopes = [sp.diff(system.dynamics[k], by) for by in symbols for k in self.states]
        found = self.values(system, slopes).reshape(len(self.rows), len(symbols), len(self.states))
        return np.asarray((found / self.scale).transpose(1, 2, 0).reshape(len(symbols), -1))

    def parameters(self) -> Array:
        """(k n, uncertain parameters)."""
        uncertain = [p for p in self.study.system.parameters if p.identify]
        return self.influence([symbol(p.name) for p in uncertain]).T

    def columns(self) -> Iterator[tuple[Term, Array]]:
        """What one unit of every term adds to the rates, (k n,)."""
        system = self.study.system
        at = {p.name: symbol(p.effort) for p in system.ports}
        at |= {item.name: symbol(item.name) for item in system.inputs}
        influence = dict(zip(at, self.influence(list(at.values())), strict=True))
        for effect in effects():
            for place in effect.places(system):
                if place.kind not in ("port", "actuator"):
                    continue
                added = effect.add(system, place, self.study.scales)
                if added.memory or added.columns or added.per_experiment or added.shares or added.delays:
                    continue
                for regressor in self._regressors(added):
                    yield Term(added.family, place.channel), influence[place.name] * regressor

    def _regressors(self, added: Added) -> Iterator[Array]:
        """(k n,) at some values of the shapes."""
        points = [dict(zip(added.shapes, v, strict=True)) for v in product(*added.shapes.values())]
        chosen = np.unique(np.linspace(0, len(points) - 1, POINTS).astype(int))
        p = np.array([added.system.with_values(points[k]).values for k in chosen])
        for values in self.values(added.system, added.regressors, p):
            yield from np.tile(values.T, len(self.states))
