"""Which channel accounts for what a model lacks, where no effect says it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from unmodelled.diagnosis.where.corrections import Corrections
from unmodelled.diagnosis.where.rules import Rule

Array = NDArray[np.float64]

#: A rule that explains less of the whole is none.
LEAST = 0.02
#: Of the whole: by how much a rule at a sensor must be better.
SENSOR = 0.1


def shares(corrections: Corrections) -> dict[str, float]:
    """Share of every channel in what the model lacks; they sum to one, or are none where nothing is lacking.

    A free correction in every window explains much at any place. So rules are sought, see `Rule`, and
    judged on experiments that they were not fitted to. The place where one lowers the errors most has that
    share, and the next one is judged on what is left. A rule at a sensor must be clearly better than others,
    as the start of a window hides an offset. What follows no rule goes to the same places as far as there
    are rules, and else to the ports, where a model may lack an effort, by how much free corrections explain.
    """
    whole = float(np.max(_lowered(corrections, corrections.gradient), initial=0.0))
    if whole <= 0.0:
        return {}
    with threadpool_limits(1):  # in matrices as small as these, threads mostly wait for each other
        ruled, left = _ruled(corrections, whole)
    ports = np.array([place.kind == "port" for place in corrections.places])
    free = np.where(ports | ~ports.any(), np.maximum(_lowered(corrections, left), 0.0), 0.0)
    known = min(float(ruled.sum()), 1.0)
    share = (2.0 - known) * ruled + (1.0 - known) ** 2 * free / max(float(free.sum()), 1e-300)
    names = [place.channel for place in corrections.places]
    return dict(zip(names, (share / share.sum()).tolist(), strict=True)) if share.sum() > 0.0 else {}


def _lowered(corrections: Corrections, gradient: Array) -> Array:
    """(places,) by how much a free correction in every window lowers the square errors, noise discounted."""
    seen, weight = corrections.seen, corrections.weight
    own = gradient[:, : weight.shape[1]]
    return np.asarray(np.where(seen, own**2 / np.where(seen, weight, 1.0) - 1.0, 0.0).sum(0))


def _ruled(corrections: Corrections, whole: float) -> tuple[Array, Array]:
    """By how much rules at the places lower the errors (places,), as shares of the whole; what is left."""
    found = np.zeros(len(corrections.places))
    handicap = [SENSOR * whole if place.kind == "sensor" else 0.0 for place in corrections.places]
    other = Rule.none(corrections).checked(corrections.gradient)
    gradient = other.gradient if other.lowered > 0.0 else corrections.gradient
    # parameters that differ from experiment to experiment do not help to judge one by the others
    pinned = other.lowered < -LEAST * whole
    rules = {k: Rule.at(corrections, k, pinned) for k in range(len(corrections.places))}
    while rules:
        checked = {k: rule.checked(gradient) for k, rule in rules.items()}
        best = max(checked, key=lambda k: checked[k].lowered - handicap[k])
        if checked[best].lowered < LEAST * whole:
            break
        found[best], gradient = checked[best].lowered / whole, checked[best].gradient
        del rules[best]
    return found, gradient
