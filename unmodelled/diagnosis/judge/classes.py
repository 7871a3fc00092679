"""Laws that the logs cannot tell apart are one class, told by its kind and place first."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.diagnosis.judge.left_out import probabilities
from unmodelled.diagnosis.judge.refit import Refit

#: A law stands from so much evidence, nats, and such a share of the squared residual of an output.
BAR, SHARE = 15.0, 0.10
#: Laws within so many nats of the best are one class with it: odds of e^10 would be believed of a true model,
#: and none is quite true.
NEAR_NATS = 10.0
#: Laws that leave at most so many times the squared residual of the best are one class with it: on a measured
#: machine what is left is other physics, of which a flexible law takes a little more.
NEAR_SQUARE = 1.5
#: Share of the squared gap of all experiments below which a law is no effect, unless it leaves noise.
LEAST = 0.05
#: Share of what the best law removes that is nearly all of it.
NEARLY_ALL = 0.8


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
    def forms(self) -> list[Refit]:
        """Return the members of the kind and place of the law to name, itself first."""
        return [one for one in self.members if one.row.about == self.speaker.row.about]

    @property
    def plainest(self) -> LawClass:
        """Return the class with the form of the fewest numbers as its speaker, itself where that speaks."""
        plain = min(self.forms, key=lambda one: one.row.atom.numbers)  # of as many, the first
        if plain.row.atom.numbers >= self.speaker.row.atom.numbers:
            return self
        k = self.members.index(plain)
        order = [k, *(j for j in range(len(self.members)) if j != k)]
        return LawClass(tuple(self.members[j] for j in order), self.probabilities[order])

    @property
    def kind(self) -> str:
        """Return what the law to name is about, such as dry friction."""
        return self.speaker.row.atom.effect.kind


def stands(one: Refit) -> bool:
    """Return whether a law is one at all."""
    return one.nats >= BAR and one.removed >= SHARE


def best_class(
    found: Sequence[Refit], large: Callable[[Refit], bool] = lambda one: one.removed >= SHARE
) -> LawClass | None:
    """Return the class of the best law that stands, None if none does.

    Laws must be `large`, by default remove a tenth of the squared residual of the known physics.
    The best one, by its evidence over all lengths, must stand; what explains a share and cannot be told from
    it needs no evidence of its own.
    The speaker has the fewest numbers of those that explain as much; of as many, the most evidence. Forms of
    the best law that explain less, laws that predict new experiments better, and the others, follow by their
    evidence, of the variants of a law at a place the plainest alone.
    """
    order = sorted((one for one in found if one.nats > 0.0 and large(one)), key=lambda one: -one.overall)
    best = next((one for one in order if one.nats >= BAR), None)
    if best is None:
        return None
    as_good = [
        one for one in order if best.overall - one.overall <= NEAR_NATS or _leaves_as_little(one, best)
    ]
    beside = [one for one in order if one not in as_good and (_is_form(one, best) or _predicts(one, best))]
    near = [one for own in (as_good, beside) for one in sorted(own, key=lambda one: one.row.atom.numbers)]
    plainest: dict[str, Refit] = {}
    for one in near:
        plainest.setdefault(one.row.name, one)
    speaker, *others = plainest.values()
    members = speaker, *sorted(others, key=lambda one: -one.overall)
    scores = np.stack([one.log_scores for one in members])
    return LawClass(members, probabilities(scores))


def _leaves_as_little(one: Refit, best: Refit) -> bool:
    """Whether a law leaves about as much as the best; of new experiments, too, where that leaves noise."""
    rows = 2 if best.residual.white else 1
    return leaves_as_little(one.square[:rows], best.square[:rows])


def leaves_as_little(square: Array, best: Array) -> bool:
    """Return whether squares (rows, outputs) are at most `NEAR_SQUARE` times the best ones, in every row."""
    return bool(np.exp(np.log(square / best).mean(axis=1).max()) <= NEAR_SQUARE)


def _predicts(one: Refit, best: Refit) -> bool:
    """Whether a law predicts experiments that are left out better than the one with the most evidence."""
    return float(one.log_scores.sum()) > float(best.log_scores.sum())


def _is_form(one: Refit, best: Refit) -> bool:
    """Whether a law is a form of the best one that removes nearly as much, where that leaves something."""
    nearly = one.row.about == best.row.about and one.removed >= NEARLY_ALL * best.removed
    return nearly and not best.residual.white
