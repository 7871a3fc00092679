"""Predictions of experiments by sets of numbers: everything else is fitted to the other experiments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from unmodelled.design.audit.fits import AuditFits, of_set
from unmodelled.design.audit.number_sets import NumberSet
from unmodelled.diagnosis.answer.models import Leaving
from unmodelled.diagnosis.data.gap import LARGEST_ERROR
from unmodelled.diagnosis.judge.refit import FAULTS

#: Root mean square errors of outputs, SI, by name.
Errors = Mapping[str, float]
#: Draws of the weights of experiments, from which follows how sure it is that a set is the best.
DRAWS, SEED = 4000, 0


@dataclass(frozen=True)
class Predicted:
    """Errors of one model in experiments that were left out."""

    errors: Errors | None  # None where the simulation cannot be fitted
    probability: float  # that the set predicts best of all sets


@dataclass(frozen=True)
class Prediction:
    """Errors of a set of numbers in experiments that were left out."""

    name: str
    fitted: tuple[str, ...]  # numbers that the set leaves open, fitted to the other experiments
    as_given: Predicted
    with_laws: Predicted | None  # the same with all laws that are missing; None without such a law


def predictions(fits: AuditFits, sets: Sequence[NumberSet]) -> tuple[Prediction, ...]:
    """Return the predictions of all sets, the best one of the model as given first."""
    as_given = _all_predicted(fits, sets, laws=False)
    with_laws = _all_predicted(fits, sets, laws=True) if fits.judged.laws else [None] * len(sets)
    rows = [
        Prediction(one.name, tuple(n for n in fits.given.uncertain if n not in one.values), plain, more)
        for one, plain, more in zip(sets, as_given, with_laws, strict=True)
    ]
    return tuple(sorted(rows, key=lambda row: -row.as_given.probability))


def errors_of(leaving: Leaving) -> Errors:
    """Return the root mean square errors of experiments left out, SI, by output."""
    gap = leaving.model.gap
    return {name: own * gap.scale[name] for name, own in gap.per_output.items()}


def _all_predicted(fits: AuditFits, sets: Sequence[NumberSet], *, laws: bool) -> list[Predicted]:
    found = [_fit(fits, one, laws=laws) for one in sets]
    squares = np.array([_squares(fits, one) for one in found])
    drawn = np.random.default_rng(SEED).dirichlet(np.ones(squares.shape[1]), DRAWS)
    best = np.bincount(np.argmin(drawn @ squares.T, axis=1), minlength=len(sets)) / DRAWS
    each = zip(found, best.tolist(), strict=True)
    return [Predicted(None if one is None else errors_of(one), share) for one, share in each]


def _fit(fits: AuditFits, one: NumberSet, *, laws: bool) -> Leaving | None:
    """A fit of the measurement chain, and of the missing laws, to the numbers of a set; None without one."""
    try:
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            return fits.fitted(of_set(fits.system, fits.given, one), laws=laws)
    except FAULTS:  # numbers with which no simulation ends
        return None


def _squares(fits: AuditFits, one: Leaving | None) -> list[float]:
    """Mean square errors of experiments left out, (experiments,), in variances of the outputs."""
    ids = fits.judged.every.logs.ids
    if one is None:
        return [LARGEST_ERROR**2] * len(ids)
    return [one.model.gap.per_experiment[i] ** 2 for i in ids]
