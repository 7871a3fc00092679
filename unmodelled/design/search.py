"""Search for the experiment of highest value: differential evolution in every family of signals."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import differential_evolution
from scipy.stats import qmc

from unmodelled.design.criterion import Criterion
from unmodelled.design.signals import FAMILIES, Family, reference_points

Array = NDArray[np.float64]

#: Members of a population, generations in every family, and further ones around the best experiment, which
#: are first drawn within `NEAR` of it: a budget of time.
POPULATION, GENERATIONS, REFINED, NEAR = 32, 16, 30, 0.05


@dataclass(frozen=True, eq=False)
class Found:
    """The experiment of highest value."""

    family: Family
    u: Array  # (samples, inputs), SI
    score: float  # see `Criterion.scores`; below 0 if no experiment keeps the limits


def best_experiment(criterion: Criterion, seed: int, progress: Callable[[str], None]) -> Found:
    """Return the experiment of highest value over all families of signals and the references."""
    limits = criterion.limits
    found: list[tuple[float, Family, Array]] = []
    for family in FAMILIES:
        progress(f"search {family.name}")
        size = family.size * len(limits.inputs)
        first = np.asarray(qmc.Halton(size, seed=seed).random(POPULATION))
        score, z = _evolved(criterion, family, first, seed, GENERATIONS)
        found.append((score, family, z))
    # a proposal is worth no less than the chirp and the random levels that it is compared with
    for family, points in reference_points(len(limits.inputs), seed).values():
        scores = criterion.scores(criterion(family.inputs(points, limits)))
        found.append((float(scores.max()), family, points[scores.argmax()]))
    score, family, z = max(found, key=lambda one: one[0])
    progress(f"refine {family.name}")
    near = z + NEAR * np.random.default_rng([seed, 2]).standard_normal((POPULATION, len(z)))
    near[0] = z
    score, z = _evolved(criterion, family, np.clip(near, 0.0, 1.0), seed, REFINED)
    return Found(family, family.inputs(z[None], limits)[0], score)


def _evolved(
    criterion: Criterion, family: Family, first: Array, seed: int, generations: int
) -> tuple[float, Array]:
    """Score and point of the best experiment that a population, shape (members, size), evolves to."""

    def cost(z: Array) -> Array:
        found = criterion(family.inputs(z.reshape(len(z), -1).T, criterion.limits))
        return np.asarray(-criterion.scores(found))

    result = differential_evolution(
        *(cost, [(0.0, 1.0)] * first.shape[1]),
        init=first,
        maxiter=generations,
        tol=0.0,
        polish=False,
        updating="deferred",
        vectorized=True,
        rng=np.random.default_rng([seed, 3]),
    )
    return -float(result.fun), np.asarray(result.x)
