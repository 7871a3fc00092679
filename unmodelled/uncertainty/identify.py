"""Maximum likelihood identification of distribution parameters (section 3.2.2, eq. 3.3)."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass

import numpy as np
from scipy.optimize import differential_evolution

from unmodelled.base.arrays import Array, Mask
from unmodelled.base.errors import BadInput
from unmodelled.base.progress import Counter
from unmodelled.uncertainty.ascent import Objective, Recorder, climb
from unmodelled.uncertainty.box import Box

#: Distance from a bound, in the unit cube of the search, that counts as lying on it.
AT_BOUND = 1e-3


@dataclass(frozen=True)
class Settings:
    """Settings of the evolutionary search.

    Attributes:
        population: number of points of the population, rounded up to a power of two; default 32 (section
            3.4.2 uses 50).
        generations: largest number of generations; default 300.
        tolerance: standard deviation of the population's log-likelihoods at which the search has converged;
            default 0.01.

    Raises:
        BadInput: if a setting is out of range.
    """

    population: int = 32
    generations: int = 300
    tolerance: float = 0.01

    def __post_init__(self) -> None:
        if self.population < 5:
            raise BadInput(f"population must be at least 5, got {self.population}")
        if self.generations < 1:
            raise BadInput(f"generations must be at least 1, got {self.generations}")
        if not self.tolerance > 0.0:
            raise BadInput(f"tolerance must be positive, got {self.tolerance:g}")


@dataclass(frozen=True)
class Identification:
    """Most likely parameters of a distribution."""

    alpha: Array  # (k,), within the bounds
    log_likelihood: float  # of all data at `alpha`
    evaluations: int  # number of them
    trace: Array  # (generations + 1,), best so far; the final local search can improve on the last value
    converged: bool  # before the last generation
    at_bound: Mask  # (k,); False for fixed parameters


def identify(
    objective: Objective,
    bounds: Array,
    settings: Settings | None = None,
    seed: int = 0,
    description: str | None = None,
) -> Identification:
    """Maximise a log-likelihood within bounds (k, 2), by differential evolution and a local search."""
    box, chosen = Box(np.asarray(bounds, float)), settings or Settings()
    if not box.free.any():
        raise BadInput("bounds: every parameter is held fixed: free one by different bounds")
    seen = Recorder(objective)
    with ExitStack() as stack:
        counter = stack.enter_context(Counter(chosen.generations, description)) if description else None
        converged = _evolve(seen, box, chosen, seed, counter)
    peak, polishing = climb(objective, box, seen.peak.alpha)
    return Identification(
        peak.alpha,
        peak.log_likelihood,
        seen.evaluations + polishing,
        np.array(seen.trace),
        converged,
        on_bound(box, peak.alpha),
    )


def on_bound(box: Box, alpha: Array) -> Mask:
    """Return whether free parameters of alpha (k,) lie on one of their bounds, (k,)."""
    unit = box.to_unit(alpha)
    found = np.zeros(box.size, bool)
    found[box.free] = np.minimum(unit, 1.0 - unit) < AT_BOUND
    return found


def _evolve(seen: Recorder, box: Box, settings: Settings, seed: int, counter: Counter | None) -> bool:
    """Run differential evolution on the unit cube and return whether it converged; `seen` keeps the best."""

    def falling(units: Array) -> Array:
        alphas = box.to_alpha(units.T)
        values = seen(alphas)
        generation = len(seen.trace) - 1
        if generation == 0:
            _check(values)
        elif counter:
            counter.update(generation)
        return -values

    free = int(box.free.sum())
    result = differential_evolution(
        falling,
        [(0.0, 1.0)] * free,
        maxiter=settings.generations,
        popsize=-(-settings.population // free),
        init="sobol",
        tol=0.0,
        atol=settings.tolerance,
        rng=seed,
        polish=False,
        vectorized=True,
        updating="deferred",
    )
    return bool(result.success)


def _check(values: Array) -> None:
    if not np.isfinite(values).any():
        raise BadInput(
            f"the log-likelihood is not finite at any of {len(values)} points within the bounds: widen them"
        )
    if np.ptp(values[np.isfinite(values)]) == 0.0 and np.isfinite(values).all():
        raise BadInput(
            f"the log-likelihood is {values[0]:.6g} at all of {len(values)} points within the bounds: "
            "it does not depend on the parameters there: choose other bounds or parameters"
        )
