"""Laws that the logs cannot tell apart are one class, told by its kind and place first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.diagnosis.judge.left_out import probabilities
from unmodelled.diagnosis.judge.refit import Refit

#: A law stands from so much evidence, nats, and such a share of the squared residual of an output.
BAR, SHARE = 15.0, 0.10
#: Laws within so many nats of the best, or such a share of its nats, are one class with it.
NEAR_NATS, NEAR_SHARE = 10.0, 0.05
#: Laws that leave at most so many times the squared residual of the best are one class with it: on a measured
#: machine what is left is other physics, of which a flexible law takes a little more.
NEAR_SQUARE = 1.5


@dataclass(frozen=True, eq=False)
class LawClass:
    """Laws that cannot be told apart; the first one speaks for all."""

    members: tuple[Refit, ...]
    probabilities: Array  # of the members, (members,)

    @property
    def speaker(self) -> Refit:
        """Return the law to name."""
        return self.members[0]

    @property
    def kind(self) -> str:
        """Return what most of the probability is about, such as dry friction."""
        kinds: dict[str, float] = {}
        for one, share in zip(self.members, self.probabilities.tolist(), strict=True):
            kind = one.row.atom.effect.kind
            kinds[kind] = kinds.get(kind, 0.0) + share
        return max(kinds, key=lambda kind: kinds[kind])


def stands(one: Refit) -> bool:
    """Return whether a law is one at all."""
    return one.nats >= BAR and one.removed >= SHARE


def best_of(found: Sequence[Refit]) -> list[Refit]:
    """Return the best refit of every law at every place, the best first."""
    best: dict[str, Refit] = {}
    for one in found:
        if one.row.name not in best or one.nats > best[one.row.name].nats:
            best[one.row.name] = one
    return sorted(best.values(), key=lambda one: -one.nats)


def best_class(found: Sequence[Refit]) -> LawClass | None:
    """Return the class of the best law that stands, None if none does.

    The speaker has the fewest numbers; of as many, the most evidence.
    """
    order = best_of(found)
    best = next((one for one in order if stands(one)), None)
    if best is None:
        return None
    reach = max(NEAR_NATS, NEAR_SHARE * best.nats)
    near = [one for one in order if abs(one.nats - best.nats) <= reach or _leaves_as_much(one, best)]
    near.sort(key=lambda one: (one.row.atom.numbers, -one.nats))
    scores = np.stack([one.score.log_scores for one in near])
    return LawClass(tuple(near), probabilities(scores))


def _leaves_as_much(one: Refit, best: Refit) -> bool:
    """Whether a law stands and leaves about the squared residual of the best."""
    more = np.exp(np.mean(np.log(one.residual.square / best.residual.square)))
    return stands(one) and bool(more <= NEAR_SQUARE)
