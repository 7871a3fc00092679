"""Identify the parameter distribution that explains measured event times."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from unmodelled.api.uncertainty_page import write_page
from unmodelled.base.files import replacing_folder
from unmodelled.base.ownership import verb
from unmodelled.learning.uncertainty.identified import identified
from unmodelled.learning.uncertainty.problem import read_problem
from unmodelled.learning.uncertainty.setup import Setup
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
    """Write and print the most likely parameter distribution by three methods, its intervals, and advice.

    Give either `system` and `logs`, or `response` and `observations`. The outputs of a system are the times
    of its event, one per experiment, and its parameters are multiples of their nominal values.

    `uncertainty.json` holds a summary, with `advice` in sentences. Tables: `points` (a row per output:
    observed, deterministic least-squares prediction, log-likelihood by every method at its own optimum),
    `estimates` (method, name, value; of the exact method the limits of the 95 % profile likelihood and of the
    parametric bootstrap), `trace` (the search), `profiles`, `pairs` (profile likelihoods), `replicates`
    (estimates of the exact method on data sets drawn from the identified distribution). The page, index.html,
    shows them; for a system, it simulates the machine.

    Args:
        system: system file with an event.
        logs: log folder.
        event, uncertain, step: see `unmodelled.learning.uncertainty.identified.identify_uncertainty`.
        response: Python function from parameters, shape (S, n), to outputs, shape (S, L), with names and
            bounds.
        observations: CSV file with the columns id, y.
        uncertainty: family of the distributions, settings of polynomial chaos and of the search.
        profile: profile of computing time, which gives the number `data_sets` of the bootstrap.
        seed: seed of searches and random samples.
        workers: number of searches that run side by side.
        out: folder that is new, empty or was made by this verb; replaced as a whole.

    Raises:
        BadInput: when the model, the logs or the observations cannot be used, when an output does not exist
            somewhere in the bounds or is not monotone.
    """
    problem = read_problem(system, logs, event, uncertain, step, response, observations)
    found = identified(problem, uncertainty, profile["data_sets"], seed, workers)
    with replacing_folder(out) as new:
        found.save(new)
        write_page(found, new, system, logs)
    print(found)
