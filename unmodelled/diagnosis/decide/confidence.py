"""Confidence of a verdict: the share of right answers among machines whose truth is known."""

from __future__ import annotations

from collections.abc import Mapping

from unmodelled.diagnosis.data.result import Verdict

#: Largest confidence: there were too few machines to say more.
HIGHEST_CONFIDENCE = 0.99
#: Right answers and all, by verdict and number of named effects (the last one: so many or more), on virtual
#: machines with measurement chains (docs/decisions/0015-rules-compared.md).
MEASURED: Mapping[Verdict, tuple[tuple[int, int], ...]] = {
    "effect": ((22, 25), (31, 39), (8, 14)),
    "main_effect": ((14, 21), (6, 11), (4, 5)),
    "no_gap": ((2, 3),),
    "unknown": ((6, 13),),
}


def confidence(verdict: Verdict, effects: int) -> float:
    """Return the share of right answers among those with the same verdict and as many effects.

    One right and one wrong answer are added to those counted, so that a share is never certain (Laplace).

    Examples:
        >>> confidence("effect", 1) > confidence("effect", 4)
        True
    """
    counted = MEASURED[verdict]
    right, every = counted[min(max(effects, 1), len(counted)) - 1]
    return (right + 1) / (every + 2)
