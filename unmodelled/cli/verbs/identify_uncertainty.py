"""Which distribution of uncertain parameters explains observed outputs (chapter 3)."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from unmodelled.base.files import replacing_folder, write_json
from unmodelled.base.ownership import verb
from unmodelled.base.parquet import write_parquet
from unmodelled.base.progress import say
from unmodelled.learning.uncertainty import report
from unmodelled.learning.uncertainty.estimate import Estimator, least_squares
from unmodelled.learning.uncertainty.problem import read_problem, shown
from unmodelled.learning.uncertainty.setup import Setup, pairs
from unmodelled.uncertainty.curvature import curvature
from unmodelled.uncertainty.methods import METHODS, PUSH_FORWARD
from unmodelled.uncertainty.profile import profile as profile_likelihood
from unmodelled.uncertainty.response import Response


@verb()
def identify_uncertainty(
    system: Path | None,
    logs: Path | None,
    event: str | None,
    uncertain: list[str] | None,
    step: float | None,
    response: Response | None,
    observations: Path | None,
    uncertainty: Setup,
    profile: Mapping[str, Any],
    seed: int,
    workers: int,
    out: Path,
) -> None:
    """Write and print the most likely distribution by three methods, its intervals, and what limits it.

    Either `system` and `logs`: the outputs are the moments of the system's event, one an experiment, and the
    parameters are multiples of their nominal values. Or `response` and `observations`.

    `uncertainty.json` holds everything in short and `advice` in sentences. Tables: `points` (a row per
    output: observed, deterministic least-squares prediction, log-likelihood by every method at its own
    optimum), `estimates` (method, name, value; of the exact method the limits of the 95 % profile likelihood
    and of the parametric bootstrap), `trace` (the search), `profiles`, `pairs` (profile likelihoods),
    `replicates` (the exact method on data sets drawn from the model that it found).

    Args:
        system: system file with an event. logs: log folder. event, uncertain: null for what the file says.
        step: of the integration, s.
        response: a Python callable, (S, n) parameters to (S, L) outputs, with its names and bounds.
        observations: CSV file with the columns id, y.
        uncertainty: family of the distributions, polynomial chaos, search.
        profile: `data_sets` of the bootstrap.
        seed: of searches and draws. workers: searches side by side.
        out: folder that is new, empty or was made by this verb; replaced as a whole.

    Raises:
        BadInput: when the model, the logs or the observations cannot be used, when an output does not exist
            somewhere in the bounds or is not monotone.
    """
    start = time.monotonic()
    problem = read_problem(system, logs, event, uncertain, step, response, observations)
    surface = uncertainty.surface(problem.response)
    estimator = Estimator(uncertainty, surface)
    say(f"identifying the distribution of {len(problem.y)} observations by {len(METHODS)} methods")
    found = {m: estimator.identify(m, problem.y, seed, f"identifying by {m}") for m in METHODS}
    exact, bounds = estimator.likelihood(PUSH_FORWARD, problem.y), estimator.bounds
    profiles = profile_likelihood(exact, bounds, found[PUSH_FORWARD].alpha, "profile likelihoods")
    bend = curvature(exact, bounds, profiles.alpha)
    seconds = time.monotonic() - start
    say(f"95 % limits, and {profile['data_sets']} data sets drawn again")
    grids = report.pair_grids(exact, bounds, profiles)
    drawn = estimator.draw(pairs(profiles.alpha), profile["data_sets"], seed)
    again = estimator.identify_all(PUSH_FORWARD, drawn, seed, workers)
    names = uncertainty.names(problem.response)
    tables = {
        "points": report.points(estimator, shown(problem, least_squares(surface, problem.y)), found),
        "estimates": report.estimates(names, found, profiles, again),
        "trace": report.trace(found),
        "profiles": report.profiles(names, profiles),
        "pairs": report.pairs(names, grids),
        "replicates": report.replicates(names, {PUSH_FORWARD: again}),
    }
    summary = report.summary(problem, estimator, found, profiles, bend, names, seconds)
    with replacing_folder(out) as folder:
        for name, table in tables.items():
            write_parquet(table, folder / f"{name}.parquet")
        write_json(folder / "uncertainty.json", summary)
    print(report.printed(tables["estimates"], summary))
