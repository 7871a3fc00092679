"""Divide the experiments of the dissertation into training and test experiments (section 6.5)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from unmodelled.base.arrays import Indices
from unmodelled.base.errors import BadInput
from unmodelled.learning.splits import Fold, Split


def fold_named(folds: Sequence[Fold], name: str) -> Fold:
    """Return the fold of a name."""
    found = next((fold for fold in folds if fold.name == name), None)
    if found is None:
        raise BadInput(f"fold: unknown {name}, must be one of {', '.join(fold.name for fold in folds)}")
    return found


def nominal_subsets(experiments: pd.DataFrame, count: int = 10) -> list[Indices]:
    """Sort the contact runs by falling minimal contact force, in subsets I_1, I_2, ... (runs,) (6.5)."""
    nominal = np.flatnonzero(experiments["label"].to_numpy() == "contact")
    if len(nominal) < count:
        raise BadInput(f"{len(nominal)} contact runs, at least {count} are needed for {count} subsets")
    order = np.argsort(-experiments["f_min"].to_numpy()[nominal], kind="stable")
    return np.array_split(nominal[order], count)


def interpolation(experiments: pd.DataFrame, folds: int = 5) -> list[Fold]:
    """Leave two neighbouring subsets out in each fold, {I_1, I_2}, {I_3, I_4}, ... (6.5.1).

    Args:
        experiments: table with columns `label` and `f_min`, a row per experiment.
        folds: number of folds.
    """
    subsets = nominal_subsets(experiments, 2 * folds)
    return [
        Fold(
            f"I{2 * j + 1}-I{2 * j + 2}",
            np.concatenate(subsets[: 2 * j] + subsets[2 * j + 2 :]),
            np.concatenate(subsets[2 * j : 2 * j + 2]),
        )
        for j in range(folds)
    ]


def extrapolation(experiments: pd.DataFrame, levels: int = 8) -> list[Fold]:
    """Train on the most stable 10 %, 20 %, ... and test on I_9 and I_10, next to the boundary (6.5.2).

    Args:
        experiments: table with columns `label` and `f_min`, a row per experiment.
        levels: number of folds.
    """
    subsets = nominal_subsets(experiments, 10)
    return [
        Fold(f"{10 * (k + 1)}%", np.concatenate(subsets[: k + 1]), np.concatenate(subsets[8:]))
        for k in range(levels)
    ]


def inner_extrapolation(experiments: pd.DataFrame, share: float = 0.7) -> list[Fold]:
    """Train on the most stable part of I_1 and test on the rest of it.

    This is where hyperparameters are chosen: it asks the question of the extrapolation without its answers.

    Args:
        experiments: table with columns `label` and `f_min`, a row per experiment.
        share: share of I_1 to train on.
    """
    first = nominal_subsets(experiments, 10)[0]
    cut = round(share * len(first))
    return [Fold("inner", first[:cut], first[cut:])]


def tuning(experiments: pd.DataFrame, share: float = 0.3, seed: int = 0) -> list[Fold]:
    """Train on a random share of the contact runs, validate on the rest: Fig. 6.16.

    Args:
        experiments: table with a column `label`, a row per experiment.
        share: share of the contact runs to train on.
        seed: seed of the random generator.
    """
    nominal = np.flatnonzero(experiments["label"].to_numpy() == "contact")
    order = np.random.default_rng(seed).permutation(nominal)
    cut = max(1, round(share * len(nominal)))
    return [Fold(f"{share:.0%}", np.sort(order[:cut]), np.sort(order[cut:]))]


def uniform(experiments: pd.DataFrame, shares: Sequence[float], seed: int = 0) -> list[Fold]:
    """Train on a random share of the runs that do not stall, test on the rest: Fig. 5.16, left.

    A larger share contains the smaller ones.

    Args:
        experiments: table with a column `label`, a row per experiment.
        shares: shares to train on, between 0 and 1, one fold each.
        seed: seed of the random generator.

    Raises:
        BadInput: when a share is not between 0 and 1.
    """
    order = np.random.default_rng(seed).permutation(_running(experiments))
    folds = []
    for share in shares:
        if not 0.0 < share < 1.0:
            raise BadInput(f"shares: must lie between 0 and 1, got {share}")
        cut = max(1, round(share * len(order)))
        folds.append(Fold(f"{share:.0%}", np.sort(order[:cut]), np.sort(order[cut:])))
    return folds


def alternate_levels(experiments: pd.DataFrame, factors: Sequence[str]) -> list[Fold]:
    """Train on the 1st, 3rd, ... level of a factor and test on the 2nd, 4th, ...: Fig. 5.16, right.

    The text says that whole cams or masses are left out, not which; levels are sorted. Stalls are left out.

    Args:
        experiments: table with a column `label` and those of the factors, a row per experiment.
        factors: names of columns, one fold each.

    Raises:
        BadInput: when there is no such column.
    """
    running = _running(experiments)
    folds = []
    for factor in factors:
        if factor not in experiments:
            raise BadInput(f"factors: the experiments have no column {factor}")
        level = np.unique(experiments[factor].to_numpy()[running], return_inverse=True)[1]
        folds.append(Fold(factor, running[level % 2 == 0], running[level % 2 == 1]))
    return folds


def joined(experiments: pd.DataFrame, parts: Mapping[str, Split]) -> list[Fold]:
    """Return the folds of several splits, one after the other.

    Args:
        experiments: table with a row per experiment.
        parts: splits by name; the names of their folds must differ.
    """
    return [fold for part in parts.values() for fold in part.folds(experiments)]


def inner_uniform(
    experiments: pd.DataFrame, share: float = 0.05, folds: int = 5, seed: int = 0
) -> list[Fold]:
    """Cross-validate inside the training runs of the fold `share` of `uniform`.

    This is where the training of recurrent networks is chosen: no run that they are judged on plays a part.

    Args:
        experiments: table with a column `label`, a row per experiment.
        share: share of the runs that the fold of `uniform` trains on.
        folds: number of folds.
        seed: seed of the random generator.
    """
    train = uniform(experiments, [share], seed)[0].train
    parts = np.array_split(np.random.default_rng(seed).permutation(train), folds)
    return [Fold(f"part {k + 1}", np.setdiff1d(train, part), np.sort(part)) for k, part in enumerate(parts)]


def _running(experiments: pd.DataFrame) -> Indices:
    """Rows of the runs that turn: contact and jump."""
    if "label" not in experiments:
        raise BadInput("the experiments have no column label")
    return np.flatnonzero(experiments["label"].to_numpy() != "stall")


def slower_half(experiments: pd.DataFrame, speed: str) -> list[Fold]:
    """Train on the slower half, test on the faster one: the region of operations of section 4.4.2.

    Args:
        experiments: table with a row per experiment.
        speed: name of the column that says how fast an experiment is.

    Raises:
        BadInput: when there is no such column.
    """
    if speed not in experiments:
        raise BadInput(f"the experiments have no column {speed}, got {', '.join(map(str, experiments))}")
    order = np.argsort(experiments[speed].to_numpy(np.float64), kind="stable")
    half = len(order) // 2
    return [Fold("slow", np.sort(order[:half]), np.sort(order[half:]))]
