"""Compare the accuracy of methods that propagate a parameter distribution to outputs."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pipeline.chapters.readable import write_chapter
from pipeline.uncertainty.assessment import Assessment
from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.base.files import read_json
from unmodelled.base.ownership import verb
from unmodelled.base.parquet import read_parquet
from unmodelled.learning.uncertainty.estimate import Estimator
from unmodelled.learning.uncertainty.problem import read_problem
from unmodelled.learning.uncertainty.setup import Setup
from unmodelled.uncertainty.methods import METHODS, PUSH_FORWARD
from unmodelled.uncertainty.response import Response


@verb()
def assess_uncertainty(
    system: Path | None,
    logs: Path | None,
    event: str | None,
    uncertain: list[str] | None,
    step: float | None,
    response: Response | None,
    observations: Path | None,
    uncertainty: Setup,
    profile: Mapping[str, Any],
    found: Path,
    truth: Path | None,
    demo: Sequence[float] | None,
    shown: int,
    fine: Sequence[int],
    seed: int,
    workers: int,
    out: Path,
) -> None:
    """Write tables that compare the methods at identified distributions, and on redrawn data sets.

    `identified`: data_set (0: the observed one), method, every parameter, log_likelihood by the method, and
    exact (the true log-likelihood there). `accuracy`: data_set, alpha_of (method that identified the
    distribution), method, id, emd (earth mover's distance to the exact density), error (of the point's
    log-likelihood). `monte_carlo`: the columns of `accuracy` for the observed data, against `samples`
    simulations per point instead of the exact densities; methods that end in _sampled take their moments from
    these samples. `sampling`: alpha_of, rule (random, even), samples, repeat, mae of the log-likelihood.
    `densities`: alpha_of, id, y and one column per method. `response`: the output number `shown` over the
    first two parameters.

    Args:
        system: system file with an event.
        logs: log folder.
        event: name of the event; null: the only one of the system file.
        uncertain: names of the uncertain parameters; null: those that the system file marks.
        step: integration step, s.
        response: Python function from parameters, shape (S, n), to outputs, shape (S, L), with names and
            bounds.
        observations: CSV file with the columns id, y.
        uncertainty: family of the distributions, settings of polynomial chaos and of the search.
        profile: profile of computing time, with `data_sets`, `samples` of the Monte Carlo reference and
            `sampling_repeats`.
        found: folder written by identify_uncertainty.
        truth: JSON file whose `alpha` is the distribution of the data sets; null: the identified
            distribution.
        demo: distribution parameters whose densities are shown too; null: none.
        shown: number of the output in the table `response`, from 1.
        fine: numbers of nodes per parameter of the response surface of the exact reference.
        seed: seed of searches and random samples.
        workers: number of searches that run side by side.
        out: folder that is new, empty or was made by this verb; replaced as a whole.

    Raises:
        BadInput: when the model, the logs or the observations cannot be used, when an output does not exist
            somewhere in the bounds or is not monotone, or when `found` does not belong to the observations.
    """
    start = time.monotonic()
    problem = read_problem(system, logs, event, uncertain, step, response, observations)
    if not 1 <= shown <= len(problem.y):
        raise BadInput(f"shown: must be the number of an output, 1 to {len(problem.y)}, got {shown}")
    estimator = Estimator(uncertainty, uncertainty.surface(problem.response))
    names = uncertainty.names(problem.response)
    best = _identified(found, names)
    planted = best[PUSH_FORWARD] if truth is None else _alpha(truth, len(names))
    study = Assessment(estimator, problem, names, tuple(fine), seed, workers)
    budget = {name: int(profile[name]) for name in ("samples", "data_sets", "sampling_repeats")}
    tables = _tables(study, best, planted, demo, budget) | {"response": study.response(shown)}
    about = {
        "samples": budget["samples"],
        "data_sets": budget["data_sets"],
        "planted": planted.tolist(),
        "truth": truth is not None,
        "demo": None if demo is None else [float(a) for a in demo],
        "simulations": int(np.prod(estimator.surface.values.shape[:-1])),
        "shown": problem.ids[shown - 1],
        "seconds": time.monotonic() - start,
    }
    write_chapter(out, tables, assessment=about)


def _tables(
    study: Assessment,
    best: Mapping[str, Array],
    planted: Array,
    demo: Sequence[float] | None,
    budget: Mapping[str, int],
) -> dict[str, pd.DataFrame]:
    """Return all tables but the response; `best`, `planted` and `demo` are parameters (2 n,)."""
    identified, accuracy = study.data_sets(best, planted, budget["data_sets"])
    shown = {} if demo is None else {"demo": np.array(demo, np.float64)}
    against_samples, densities = study.against_monte_carlo(
        {method: best[method] for method in METHODS} | shown, budget["samples"]
    )
    return {
        "identified": identified,
        "accuracy": accuracy,
        "monte_carlo": against_samples,
        "densities": densities,
        "sampling": study.sampling(best, against_samples, budget["sampling_repeats"]),
    }


def _identified(folder: Path, names: Sequence[str]) -> dict[str, Array]:
    table = read_parquet(folder / "estimates.parquet", ["method", "name", "value"])
    found = {m: rows.set_index("name")["value"] for m, rows in table.groupby("method")}
    if set(found) != set(METHODS) or any(set(rows.index) != set(names) for rows in found.values()):
        raise BadInput(f"{folder}: was not written for the parameters {', '.join(names)}")
    return {m: rows[list(names)].to_numpy(np.float64) for m, rows in found.items()}


def _alpha(path: Path, count: int) -> Array:
    content = read_json(path)
    alpha = content.get("alpha") if isinstance(content, dict) else None
    if not isinstance(alpha, list) or len(alpha) != count:
        raise BadInput(f"{path}: alpha: must be {count} numbers")
    return np.array(alpha, np.float64)
