"""Identify the parameter distribution that explains measured event times: a result with tables and advice."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from unmodelled.base.files import replacing_folder, write_json
from unmodelled.base.notebook import shown as in_notebook
from unmodelled.base.ownership import writing
from unmodelled.base.progress import say
from unmodelled.base.tables import write_table
from unmodelled.learning.uncertainty import report
from unmodelled.learning.uncertainty.estimate import Estimator
from unmodelled.learning.uncertainty.problem import Problem, of_observations, of_system
from unmodelled.learning.uncertainty.setup import Setup, pairs
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System
from unmodelled.uncertainty.curvature import curvature
from unmodelled.uncertainty.families import ClippedNormal
from unmodelled.uncertainty.identify import Settings
from unmodelled.uncertainty.methods import METHODS, PUSH_FORWARD
from unmodelled.uncertainty.profile import profile as profile_likelihood
from unmodelled.uncertainty.response import Response

#: Normal distributions, clipped to the bounds of the parameters: conf/uncertainty/clipped_normal.yaml.
CLIPPED_NORMAL = Setup(ClippedNormal, (0.002, 0.3), search=Settings(generations=60))


@dataclass(frozen=True, eq=False, repr=False)
class IdentifiedUncertainty:
    """The most likely parameter distribution by three methods; made by `identify_uncertainty`.

    Attributes:
        points: a row per observation: id, y, deviation (standard error), deterministic (prediction of the
            least squares), log_likelihood_<method> at the optimum of the method, floored_<method>.
        estimates: method, name, value, at_bound; of the exact method low and high (95 % profile likelihood),
            bootstrap_low and bootstrap_high (95 % of data sets drawn again), nan for the others.
        trace: method, generation, log_likelihood of the search, the best so far.
        profiles: name, value, deviance of the profile likelihoods, and every parameter at that point.
        pairs: first, second (names), x, y (values), deviance of the profile likelihoods of pairs.
        replicates: method, data_set (from 1), log_likelihood, converged and every parameter: the exact method
            on data sets drawn from the distribution that it found.
        content: content of uncertainty.json.
        sources: paths of the system file and the log folder; empty texts if there are none.
    """

    points: pd.DataFrame
    estimates: pd.DataFrame
    trace: pd.DataFrame
    profiles: pd.DataFrame
    pairs: pd.DataFrame
    replicates: pd.DataFrame
    content: dict[str, Any]
    sources: tuple[str, str] = ("", "")

    @property
    def advice(self) -> tuple[str, ...]:
        """Sentences on the limits of the identification."""
        return tuple(self.content["advice"])

    @property
    def most_likely(self) -> dict[str, float]:
        """Numbers of the distribution by the exact method, by name."""
        found: dict[str, float] = self.content["methods"][PUSH_FORWARD]["alpha"]
        return found

    def table(self) -> pd.DataFrame:
        """Return the estimates."""
        return self.estimates

    def save(self, folder: Path | str) -> None:
        """Write uncertainty.json and the tables points, estimates, trace, profiles, pairs and replicates.

        The tables are Parquet files, or CSV files if pyarrow is not installed.

        Args:
            folder: folder that is new, empty or holds an older result; replaced as a whole.

        Raises:
            BadInput: when the folder may not be replaced or cannot be written.
        """
        sources = dict(zip(("system", "logs"), self.sources, strict=True))
        with writing("identify_uncertainty", Path(folder), sources), replacing_folder(Path(folder)) as new:
            for name in ("points", "estimates", "trace", "profiles", "pairs", "replicates"):
                write_table(getattr(self, name), new / name)
            write_json(new / "uncertainty.json", self.content)

    def __repr__(self) -> str:
        return report.printed(self.estimates, self.content)

    def _repr_html_(self) -> str:
        return in_notebook("Identified uncertainty", self.advice, {"Estimates": self.estimates})


def identify_uncertainty(
    system: System,
    logs: Logs,
    event: str | None = None,
    uncertain: Sequence[str] | None = None,
    step: float | None = None,
    setup: Setup = CLIPPED_NORMAL,
    data_sets: int = 40,
    seed: int = 0,
    workers: int = 2,
) -> IdentifiedUncertainty:
    """Identify which distribution of uncertain parameters explains the measured times of an event.

    The parameters scatter from experiment to experiment; they are given as multiples of their values in the
    system file.

    Args:
        system: system with one event or more.
        logs: measured experiments that show the event, read for this system.
        event: name of the event; default: the only one of the system.
        uncertain: names of the uncertain parameters; default: those marked `identify`.
        step: step of the integration, s; default: as accurate as the event asks for.
        setup: family of the distributions, polynomial chaos and search; default: clipped normal.
        data_sets: number of data sets of the parametric bootstrap; default 40.
        seed: seed of the searches and of the bootstrap; default 0.
        workers: number of searches side by side; default 2.

    Returns:
        Estimates with intervals, profile likelihoods, and advice in sentences.

    Raises:
        BadInput: when the system has no such event or nothing uncertain, when the logs do not show the event,
            or when an event does not happen somewhere in the bounds.

    Examples:
        The brake's torque was drawn with mean 0.9 and standard deviation 0.1, in multiples of its value:

        >>> import unmodelled as um
        >>> system, logs = um.example("flywheel")
        >>> found = um.identify_uncertainty(system, logs, data_sets=4)
        >>> found.table().query("method == 'push_forward'")[["name", "value"]].round(2)
              name  value
        4     mu_1   0.88
        5  sigma_1   0.09
    """
    problem = of_system(system, logs, event, uncertain, step)
    return identified(problem, setup, data_sets, seed, workers, (system.source, logs.source))


def identify_response(
    response: Response,
    observations: pd.DataFrame,
    setup: Setup = CLIPPED_NORMAL,
    data_sets: int = 40,
    seed: int = 0,
    workers: int = 2,
) -> IdentifiedUncertainty:
    """Identify which distribution of the parameters of a Python function explains observed outputs.

    Args:
        response: function of (S, n) parameters to (S, L) outputs, with names and bounds of the parameters;
            `unmodelled.uncertainty.response.Formula` for instance.
        observations: L rows in the order of the outputs, with the columns id and y, optionally deviation
            (standard error of y).
        setup: family of the distributions, polynomial chaos and search; default: clipped normal.
        data_sets: number of data sets of the parametric bootstrap; default 40.
        seed: seed of the searches and of the bootstrap; default 0.
        workers: number of searches side by side; default 2.

    Raises:
        BadInput: when the observations are not as many as the outputs, or an output does not exist somewhere
            in the bounds or is not monotone.

    Examples:
        Eight outputs of one parameter that scatters by 0.1 about 1:

        >>> import numpy as np, pandas as pd
        >>> import unmodelled as um
        >>> from unmodelled.uncertainty.response import Formula
        >>> gain = np.linspace(1.0, 2.0, 8)
        >>> model = Formula(("theta",), np.array([[0.5, 1.5]]), lambda theta: theta * gain)
        >>> drawn = gain * np.random.default_rng(0).normal(1.0, 0.1, 8)
        >>> observed = pd.DataFrame({"id": [f"P{k}" for k in range(8)], "y": drawn})
        >>> found = um.identify_response(model, observed, data_sets=4)
        >>> found.table().query("name == 'mu_1'")[["method", "value"]].round(1)
                    method  value
        0         gaussian    1.0
        2  maximum_entropy    1.0
        4     push_forward    1.0
    """
    return identified(of_observations(response, observations), setup, data_sets, seed, workers)


def identified(
    problem: Problem,
    setup: Setup,
    data_sets: int,
    seed: int,
    workers: int,
    sources: tuple[str, str] = ("", ""),
) -> IdentifiedUncertainty:
    """Identify the distribution that explains the observations of a problem."""
    start = time.monotonic()
    estimator = Estimator(setup, setup.surface(problem.response))
    say(f"identifying the distribution of {len(problem.y)} observations by {len(METHODS)} methods")
    found = {m: estimator.identify(m, problem.y, seed, f"identifying by {m}") for m in METHODS}
    exact, bounds = estimator.likelihood(PUSH_FORWARD, problem.y), estimator.bounds
    profiles = profile_likelihood(exact, bounds, found[PUSH_FORWARD].alpha, "profile likelihoods")
    bend = curvature(exact, bounds, profiles.alpha)
    seconds = time.monotonic() - start
    say(f"95 % limits, and {data_sets} data sets drawn again")
    grids = report.pair_grids(exact, bounds, profiles)
    drawn = estimator.draw(pairs(profiles.alpha), data_sets, seed)
    again = estimator.identify_all(PUSH_FORWARD, drawn, seed, workers)
    names = setup.names(problem.response)
    return IdentifiedUncertainty(
        points=report.points(estimator, problem, found),
        estimates=report.estimates(names, found, profiles, again),
        trace=report.trace(found),
        profiles=report.profiles(names, profiles),
        pairs=report.pairs(names, grids),
        replicates=report.replicates(names, again),
        content=report.summary(problem, estimator, found, profiles, bend, names, seconds),
        sources=sources,
    )
