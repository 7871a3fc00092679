"""Compare approximate densities and log-likelihoods with accurate ones (sections 3.4.1 to 3.4.3)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from pipeline.uncertainty.empirical import Empirical
from pipeline.uncertainty.moments import of_moments
from pipeline.uncertainty.references import earth_mover_distance
from pipeline.uncertainty.sampled import MonteCarlo, QuasiMonteCarlo
from unmodelled.base.arrays import Array
from unmodelled.base.progress import track
from unmodelled.base.workers import threads_of
from unmodelled.learning.uncertainty.estimate import Estimator
from unmodelled.learning.uncertainty.problem import Problem
from unmodelled.learning.uncertainty.setup import pairs
from unmodelled.uncertainty.density import Density
from unmodelled.uncertainty.likelihood import log_likelihoods
from unmodelled.uncertainty.methods import CHAOS, GAUSSIAN, MAXIMUM_ENTROPY, METHODS, PLANTED, PUSH_FORWARD
from unmodelled.uncertainty.propagation import ExactPushForward, Propagation
from unmodelled.uncertainty.surface import ResponseSurface

Alphas = Mapping[str, Array]

#: What is compared at each optimum.
COMPARED = {GAUSSIAN: CHAOS, MAXIMUM_ENTROPY: CHAOS, PUSH_FORWARD: (PUSH_FORWARD,), PLANTED: METHODS}
#: Simulations a point in Fig. 3.17; points of a drawn density; nodes of the drawn response.
SIZES = (25, 50, 100, 200, 400, 800, 1600, 3200)
CURVE, GRID = 160, 41


@dataclass(frozen=True, eq=False)
class Assessment:
    """Comparison of the methods of propagation on one problem."""

    estimator: Estimator
    problem: Problem  # with L outputs
    names: Sequence[str]  # of the 2 n distribution parameters
    fine: tuple[int, ...]  # nodes per parameter of the surface for the reference densities
    seed: int
    workers: int  # number of searches that run side by side

    @cached_property
    def propagations(self) -> dict[str, Propagation]:
        """Methods of propagation by name, on the surface of the estimator."""
        return self.estimator.setup.propagations(self.estimator.surface)

    @cached_property
    def exact(self) -> ExactPushForward:
        """Exact push-forward on the finer surface: the reference of the other methods."""
        fine = ResponseSurface.of(self.problem.response, self.fine)
        return ExactPushForward(fine, self.estimator.setup.families(fine))

    def data_sets(self, best: Alphas, planted: Array, count: int) -> tuple[pd.DataFrame, pd.DataFrame]:
        """Identify distributions (2 n,) from drawn data sets, and compare the methods at each optimum."""
        drawn = self.estimator.draw(pairs(planted), count, self.seed)
        again = {m: self.estimator.identify_all(m, drawn, self.seed, self.workers) for m in METHODS}
        jobs = [
            (k, of, alpha, y)
            for of in METHODS
            for k, (alpha, y) in enumerate(
                [(best[of], self.problem.y), *((f.alpha, y) for f, y in zip(again[of], drawn, strict=True))]
            )
        ]
        jobs += [(k, PLANTED, planted, y) for k, y in enumerate(drawn, start=1)]
        self.exact.surface.monotone  # noqa: B018 - once, before several threads need it
        with threads_of(self.workers) as pool:
            done = track(pool.map(self._compared, jobs), len(jobs), "comparing densities")
            rows, tables = zip(*done, strict=True)
        columns = ["data_set", "method", *self.names, "log_likelihood", "exact"]
        return pd.DataFrame(list(rows), columns=columns), pd.concat(tables, ignore_index=True)

    def _compared(self, job: tuple[int, str, Array, Array]) -> tuple[tuple[Any, ...], pd.DataFrame]:
        """A row of `identified` and rows of `accuracy`."""
        k, of, alpha, y = job
        two = pairs(alpha)
        exact = self.exact(two)
        true = self.log_likelihood(exact, y)
        made = {method: self.propagations[method](two) for method in COMPARED[of]}
        table = pd.concat([self._errors(of, m, made[m], exact, true, y) for m in made], ignore_index=True)
        table.insert(0, "data_set", k)
        own = PUSH_FORWARD if of == PLANTED else of
        estimated = true + table.loc[table["method"] == own, "error"].to_numpy()
        return (k, of, *alpha, float(estimated.sum()), float(true.sum())), table

    def _errors(
        self, of: str, method: str, density: Density, exact: Density, true: Array, y: Array
    ) -> pd.DataFrame:
        """A row per output (L,) of the errors of one method; `true` (L,) are exact log-likelihoods."""
        columns = {
            "alpha_of": of,
            "method": method,
            "id": self.problem.ids,
            "emd": earth_mover_distance(density, exact),
            "error": self.log_likelihood(density, y) - true,
        }
        return pd.DataFrame(columns)

    def log_likelihood(self, density: Density, y: Array) -> Array:
        """Return the log-likelihoods (L,) of outputs (L,), not below the floor of the estimator."""
        return log_likelihoods(density, y, self.estimator.floor).each

    def against_monte_carlo(self, chosen: Alphas, samples: int) -> tuple[pd.DataFrame, pd.DataFrame]:
        """Compare all methods with Monte Carlo simulation at chosen distributions (2 n,)."""
        response, families = self.problem.response, self.estimator.setup.families(self.problem.response)
        rows, curves = [], []
        for of, alpha in track(chosen.items(), len(chosen), f"{samples} simulations a point"):
            sampler = MonteCarlo(response, families, samples, self.seed)
            drawn = np.concatenate(list(sampler.outputs(pairs(alpha))))
            reference = Empirical.of(drawn)
            true = self.log_likelihood(reference, self.problem.y)
            made = {name: way(pairs(alpha)) for name, way in self.propagations.items()}
            made[f"{GAUSSIAN}_sampled"] = of_moments([drawn], 2)
            made[f"{MAXIMUM_ENTROPY}_sampled"] = of_moments([drawn], self.estimator.setup.moments)
            for name, density in made.items():
                table = self._errors(of, name, density, reference, true, self.problem.y)
                rows.append(table.assign(reference=true, fallback=getattr(density, "fallback", False)))
            curves.append(self._curves(of, {"monte_carlo": reference, **made}))
        return pd.concat(rows, ignore_index=True), pd.concat(curves, ignore_index=True)

    def sampling(self, best: Alphas, against: pd.DataFrame, repeats: int) -> pd.DataFrame:
        """Return the error of plain sampling with few simulations, table `sampling` (Fig. 3.17)."""
        response, families = self.problem.response, self.estimator.setup.families(self.problem.response)
        rows = []
        for of in CHAOS:
            two = pairs(best[of])
            rows_of = against[(against["alpha_of"] == of) & (against["method"] == of)]
            true = rows_of["reference"].to_numpy()

            def error(way: Propagation, two: Array = two, true: Array = true) -> float:
                return float(np.abs(self.log_likelihood(way(two), self.problem.y) - true).mean())

            for size in SIZES:
                own = [MonteCarlo(response, families, size, self.seed + 1 + k) for k in range(repeats)]
                rows += [(of, "random", size, k, error(way)) for k, way in enumerate(own)]
                rows.append((of, "even", size, 0, error(QuasiMonteCarlo(response, families, size))))
        return pd.DataFrame(rows, columns=["alpha_of", "rule", "samples", "repeat", "mae"])

    def response(self, number: int) -> pd.DataFrame:
        """Return one output on a grid over the first two parameters, others at the centre of their bounds."""
        surface = self.estimator.surface
        axes = [np.linspace(low, high, GRID) for low, high in surface.bounds[:2]]
        theta = np.stack([a.ravel() for a in np.meshgrid(*axes, indexing="ij")], axis=1)
        whole = np.tile(surface.bounds.mean(axis=1), (len(theta), 1))
        whole[:, : theta.shape[1]] = theta
        y = self.problem.response(whole)[:, number - 1]
        columns = {name: whole[:, k] for k, name in enumerate(surface.names[:2])}
        return pd.DataFrame({**columns, "y": y})

    def _curves(self, of: str, densities: Mapping[str, Density]) -> pd.DataFrame:
        """Densities on a grid over the window of the reference, a column each."""
        low, high = densities["monte_carlo"].window().T
        y = low + np.linspace(-0.05, 1.05, CURVE)[:, None] * (high - low)
        columns = {name: density.density(y).T.ravel() for name, density in densities.items()}
        ids = np.repeat(np.array(self.problem.ids, object), CURVE)
        return pd.DataFrame({"alpha_of": of, "id": ids, "y": y.T.ravel(), **columns})
