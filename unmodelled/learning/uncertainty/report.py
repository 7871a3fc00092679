"""Tables and sentences about an inverse uncertainty identification."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np
import pandas as pd

from unmodelled.base.arrays import Array
from unmodelled.learning.uncertainty.estimate import Estimator, Objective, least_squares
from unmodelled.learning.uncertainty.problem import Problem
from unmodelled.learning.uncertainty.setup import pairs as by_parameter
from unmodelled.uncertainty.advice import advice
from unmodelled.uncertainty.curvature import Curvature
from unmodelled.uncertainty.identify import Identification
from unmodelled.uncertainty.likelihood import log_likelihoods
from unmodelled.uncertainty.methods import METHODS, PUSH_FORWARD
from unmodelled.uncertainty.profile import PairProfile, Profiles, profile_pair
from unmodelled.uncertainty.replicate import estimate_intervals

Found = Mapping[str, Identification]
SCHEMA = "uncertainty/1"
#: Values of each parameter in the profile of a pair.
GRID = 9


def pair_grids(objective: Objective, bounds: Array, found: Profiles) -> dict[tuple[int, int], PairProfile]:
    """Compute the profile likelihoods of all pairs of parameters, over ranges within bounds (2 n, 2)."""
    ranges = {c.index: np.linspace(c.values.min(), c.values.max(), GRID) for c in found.curves}
    return {
        (i, j): profile_pair(objective, bounds, found.alpha, (i, j), ranges[i], ranges[j])
        for i, j in combinations(sorted(ranges), 2)
    }


def points(estimator: Estimator, problem: Problem, found: Found) -> pd.DataFrame:
    """Return the table `points`, with the log-likelihoods at the optimum of each method."""
    best = least_squares(estimator.surface, problem.y)
    columns: dict[str, Any] = {"id": problem.ids, "y": problem.y, "deviation": problem.deviation}
    columns["deterministic"] = problem.response(best[None])[0]
    for method, propagation in estimator.setup.propagations(estimator.surface).items():
        own = log_likelihoods(propagation(by_parameter(found[method].alpha)), problem.y, estimator.floor)
        columns |= {f"log_likelihood_{method}": own.each, f"floored_{method}": own.floored}
    return pd.DataFrame(columns)


def estimates(
    names: Sequence[str],
    found: Found,
    profiles: Profiles,
    again: Sequence[Identification],
) -> pd.DataFrame:
    """Return the table `estimates` of an identification, see `IdentifiedUncertainty`."""
    rows = []
    limits = np.where(np.isfinite(profiles.intervals), profiles.intervals, np.nan)
    nothing = np.full((len(names), 4), np.nan)
    for method in METHODS:
        exact = method == PUSH_FORWARD
        alpha = profiles.alpha if exact else found[method].alpha
        ends = np.hstack([limits, estimate_intervals(again)]) if exact else nothing
        for k, name in enumerate(names):
            rows.append((method, name, alpha[k], found[method].at_bound[k], *ends[k]))
    columns = ["method", "name", "value", "at_bound", "low", "high", "bootstrap_low", "bootstrap_high"]
    return pd.DataFrame(rows, columns=columns)


def trace(found: Found) -> pd.DataFrame:
    """Return the table `trace`: the progress of every search."""
    parts = [
        pd.DataFrame({"method": m, "generation": np.arange(len(f.trace)), "log_likelihood": f.trace})
        for m, f in found.items()
    ]
    return pd.concat(parts, ignore_index=True)


def profiles(names: Sequence[str], found: Profiles) -> pd.DataFrame:
    """Return the table `profiles`."""
    parts = [
        pd.DataFrame({"name": names[c.index], "value": c.values, "deviance": c.deviance}).join(
            pd.DataFrame(c.alphas, columns=list(names))
        )
        for c in found.curves
    ]
    return pd.concat(parts, ignore_index=True)


def pairs(names: Sequence[str], grids: Mapping[tuple[int, int], PairProfile]) -> pd.DataFrame:
    """Return the table `pairs`."""
    parts = []
    for (i, j), grid in grids.items():
        x, y = np.meshgrid(grid.first, grid.second, indexing="ij")
        values = {"x": x.ravel(), "y": y.ravel(), "deviance": grid.deviance.ravel()}
        parts.append(pd.DataFrame({"first": names[i], "second": names[j], **values}))
    return pd.concat(parts, ignore_index=True)


def replicates(names: Sequence[str], again: Sequence[Identification]) -> pd.DataFrame:
    """Return the table `replicates`: the estimates of the exact method from redrawn data sets."""
    columns = {
        "method": PUSH_FORWARD,
        "data_set": np.arange(1, len(again) + 1),
        "log_likelihood": [f.log_likelihood for f in again],
        "converged": [f.converged for f in again],
    }
    return pd.DataFrame(columns).join(pd.DataFrame([f.alpha for f in again], columns=list(names)))


def summary(
    problem: Problem,
    estimator: Estimator,
    found: Found,
    likelihoods: Profiles,
    bend: Curvature,
    names: Sequence[str],
    seconds: float,
) -> dict[str, Any]:
    """Return the content of uncertainty.json."""
    surface, setup = estimator.surface, estimator.setup
    return {
        "schema": SCHEMA,
        "parameters": list(problem.response.names),
        "bounds": problem.response.bounds.tolist(),
        "unit": problem.unit,
        "observations": len(problem.y),
        "families": [type(family).__name__ for family in setup.families(surface)],
        "methods": {
            m: {
                "alpha": dict(zip(names, f.alpha.tolist(), strict=True)),
                "log_likelihood": f.log_likelihood,
                "evaluations": f.evaluations,
                "converged": f.converged,
            }
            for m, f in found.items()
        },
        "floor": {"tail": setup.tail, "lowest": float(estimator.floor.min())},
        "simulations": int(np.prod(surface.values.shape[:-1])),
        "surface_error": float(np.median(surface.errors.max(axis=0))),
        "correlation": {
            a: dict(zip(names, row, strict=True))
            for a, row in zip(names, bend.correlation.tolist(), strict=True)
        },
        "advice": advice(names, likelihoods, bend),
        "seconds": seconds,
    }


def printed(table: pd.DataFrame, content: Mapping[str, Any]) -> str:
    """Format the estimates and the advice as text."""
    values = table.pivot(index="name", columns="method", values="value").reindex(columns=list(METHODS))
    lines = [f"{'':<12}" + "".join(f"{m.replace('_', ' '):>18}" for m in METHODS)]
    lines += [f"{name:<12}" + "".join(f"{v:>18.4g}" for v in row) for name, row in values.iterrows()]
    own = [content["methods"][m]["log_likelihood"] for m in METHODS]
    lines.append(f"{'log L':<12}" + "".join(f"{v:>18.5g}" for v in own))
    lines += ["", f"{content['observations']} points, {content['simulations']} simulations each"]
    return "\n".join([*lines, *(f"- {sentence}" for sentence in content["advice"])])
