"""Maximum likelihood identification of the parameters of a distribution (section 3.2.2, equation 3.3)."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import differential_evolution

from unmodelled.base.errors import BadInput
from unmodelled.base.progress import Counter
from unmodelled.uncertainty.ascent import Objective, Recorder, climb
from unmodelled.uncertainty.box import Box

Array = NDArray[np.float64]

#: Distance from a bound, in the unit cube of the search, that counts as lying on it.
AT_BOUND = 1e-3


@dataclass(frozen=True)
class Settings:
    """Of the evolutionary search.

    Attributes:
        population: points that evolve, rounded up to a power of two; the text uses 50 (section 3.4.2).
        generations: at most.
        tolerance: standard deviation of the population's log-likelihoods at which it has converged.

    Raises:
        BadInput: when a setting is not possible.
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
    """The most likely parameters.

    Attributes:
        alpha: (k,) parameters, inside the bounds.
        log_likelihood: of all data at `alpha`, natural logarithm.
        evaluations: of the log-likelihood that the search took.
        trace: (generations + 1,) best log-likelihood of the first population and after every generation;
            the local search at the end may lie above its last entry.
        converged: whether the population met before the generations ran out.
        at_bound: (k,) whether a parameter lies on one of its bounds; false for those held fixed.
    """

    alpha: Array
    log_likelihood: float
    evaluations: int
    trace: Array
    converged: bool
    at_bound: NDArray[np.bool_]


def identify(
    objective: Objective,
    bounds: Array,
    settings: Settings | None = None,
    seed: int = 0,
    description: str | None = None,
) -> Identification:
    """Parameters that maximise a log-likelihood in a box: differential evolution, then a local search.

    The same seed gives the same result.

    Args:
        objective: log-likelihoods (B,) of a batch of parameters (B, k); it may be noisy at 1e-6, and what is
            not finite counts as minus infinity.
        bounds: (k, 2) of the parameters; equal ones hold a parameter fixed.
        settings: of the search.
        seed: of the search.
        description: of the work, for a progress bar; without it there is none.

    Raises:
        BadInput: when the bounds are not possible or leave nothing free, or the log-likelihood of the first
            population is nowhere finite or everywhere the same.
    """
    box, chosen = Box(np.asarray(bounds, float)), settings or Settings()
    if not box.free.any():
        raise BadInput("bounds: every parameter is held fixed, there is nothing to identify")
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


def on_bound(box: Box, alpha: Array) -> NDArray[np.bool_]:
    """(k,) whether a free parameter lies on one of its bounds."""
    unit = box.to_unit(alpha)
    found = np.zeros(box.size, bool)
    found[box.free] = np.minimum(unit, 1.0 - unit) < AT_BOUND
    return found


def _evolve(seen: Recorder, box: Box, settings: Settings, seed: int, counter: Counter | None) -> bool:
    """Runs differential evolution on the unit cube; whether it converged. `seen` keeps what it found."""

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
        raise BadInput(f"the log-likelihood is not finite at any of {len(values)} points within the bounds")
    if np.ptp(values[np.isfinite(values)]) == 0.0 and np.isfinite(values).all():
        raise BadInput(
            f"the log-likelihood is {values[0]:.6g} at all of {len(values)} points within the bounds: "
            "it does not depend on the parameters there"
        )
