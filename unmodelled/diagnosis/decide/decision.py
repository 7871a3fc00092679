"""The decision among fitted candidates: verdict, named candidate, effects that cannot be told apart.

This is the only place that turns errors of candidates into a verdict: another rule replaces `decide`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from unmodelled.diagnosis.data.result import Verdict
from unmodelled.diagnosis.data.thresholds import DEFAULT_THRESHOLDS, Thresholds
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis
from unmodelled.diagnosis.search.candidates import Candidates, noise_ratio
from unmodelled.effects.added import Added


@dataclass(frozen=True, eq=False)
class Decision:
    """A decision about fitted candidates.

    Attributes:
        verdict: effect, no_gap or unknown.
        named: number of the named candidate in `Candidates.fits`; 0 is the known physics.
        indistinguishable: effects that these data cannot tell from an effect of the named candidate, the
            best first, by the number of that effect.
    """

    verdict: Verdict
    named: int
    indistinguishable: Mapping[int, tuple[Added, ...]]


def decide(candidates: Candidates) -> Decision:
    """Choose the candidate that explains the gap, and the verdict.

    Args:
        candidates: fitted hypotheses with their losses per experiment, shape (candidates, experiments), and
            the thresholds of the decision.

    Returns:
        The decision.
    """
    named = named_candidate(candidates)
    return Decision(_verdict(candidates, named), named, indistinguishable(candidates, named))


def named_candidate(candidates: Candidates) -> int:
    """Return the number of the candidate to name.

    It is the leading one, or a simpler one where no candidate comes near the noise: there, laws of the
    library significantly fit what is caused by something else, and complexity is weighed against the gap.

    Args:
        candidates: fitted hypotheses.
    """
    limits, complexity = candidates.thresholds, candidates.complexity
    leading = candidates.leading()
    if not leading or min(map(noise_ratio, candidates.fits)) <= limits.far_from_floor:
        return leading
    simpler = [k for k in range(1, len(candidates.fits)) if complexity[k] < complexity[leading]]
    price = limits.complexity_share * noise_ratio(candidates.fits[0])
    return min(
        [leading, *simpler], key=lambda k: noise_ratio(candidates.fits[k]) + price * float(complexity[k])
    )


def gap_explained(
    known: FittedHypothesis, fitted: FittedHypothesis, thresholds: Thresholds = DEFAULT_THRESHOLDS
) -> bool:
    """Return whether only noise remains, or a small share of the gap of the known physics.

    Args:
        known: fit of the known physics.
        fitted: fit of the named candidate.
        thresholds: `above_floor` and `above_floor_share` are used.
    """
    least = max(thresholds.above_floor, thresholds.above_floor_share * noise_ratio(known))
    return noise_ratio(fitted) <= least


def indistinguishable(candidates: Candidates, named: int) -> Mapping[int, tuple[Added, ...]]:
    """Return the effects that these data cannot tell from the effects of the named candidate.

    Two candidates are compared that differ in one effect only.

    Args:
        candidates: fitted hypotheses.
        named: number of the named candidate.

    Returns:
        By number of an effect of the named candidate: other effects, the best first.
    """
    own = candidates.fits[named].hypothesis.effects
    found: dict[int, dict[tuple[str, str], Added]] = {k: {} for k in range(len(own))}
    for other in np.argsort(candidates.losses.sum(1)).tolist():
        swapped = _swapped(own, candidates.fits[other].hypothesis.effects)
        if swapped is not None and _equal(candidates, named, other):
            k, effect = swapped
            if _channel(effect) != _channel(own[k]) and len(found[k]) < candidates.thresholds.most_equal:
                found[k].setdefault(_channel(effect), effect)
    return {k: tuple(others.values()) for k, others in found.items()}


def _verdict(candidates: Candidates, named: int) -> Verdict:
    chosen = candidates.fits[named]
    if not gap_explained(candidates.fits[0], chosen, candidates.thresholds):
        return "unknown"
    return "effect" if chosen.hypothesis.effects else "no_gap"


def _equal(candidates: Candidates, named: int, other: int) -> bool:
    """Whether the losses of two candidates cannot be told apart, experiment by experiment."""
    limits, complexity = candidates.thresholds, candidates.complexity
    worse = candidates.losses[other] - candidates.losses[named]
    if complexity[other] > complexity[named] + limits.same_complexity:
        return bool(worse.sum() < -limits.better_loss)
    deviation = np.std(worse, ddof=1) / np.sqrt(len(worse)) if len(worse) > 1 else np.inf
    mixed = (
        worse.mean() < limits.mixed_t * deviation
        and worse.sum() < limits.mixed_loss_per_value * candidates.count
    )
    equal = max(limits.equal_loss, limits.equal_loss_per_value * candidates.count)
    return bool(mixed or worse.sum() < equal)


def _channel(effect: Added) -> tuple[str, str]:
    return effect.family, effect.place.channel


def _swapped(own: Sequence[Added], others: Sequence[Added]) -> tuple[int, Added] | None:
    """The number of the one effect of `own` that another one replaces among `others`, and that other one."""
    mine, theirs = ({(e.family, e.variant, e.place): e for e in es} for es in (own, others))
    gone, new = mine.keys() - theirs.keys(), theirs.keys() - mine.keys()
    if len(own) != len(others) or len(gone) != 1:
        return None
    effect = mine[next(iter(gone))]
    return list(own).index(effect), theirs[next(iter(new))]
