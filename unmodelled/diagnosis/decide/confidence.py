"""Confidence of a verdict: the share of right answers among machines whose truth is known."""

from __future__ import annotations

from collections.abc import Mapping

from unmodelled.diagnosis.data.result import Verdict

#: Largest confidence: there were too few machines to say more.
HIGHEST_CONFIDENCE = 0.99
#: Share of the squared gap of the held-out experiments from which named effects explain most of it.
MOST = 0.5
#: Right answers and all, by verdict, on 693 virtual machines with measurement chains
#: (docs/decisions/0016-fresh-evidence.md): of an `effect` by the number of laws (the last one: so many or
#: more), of a `main_effect` where it explains most of the gap, and where not.
MEASURED: Mapping[Verdict, tuple[tuple[int, int], ...]] = {
    "effect": ((121, 142), (129, 166), (47, 72)),
    "main_effect": ((110, 192), (11, 30)),
    "no_gap": ((37, 41),),
    "unknown": ((19, 50),),
}


def confidence(verdict: Verdict, effects: int, explained: float) -> float:
    """Return the share of right answers among those alike, with one right and one wrong more (Laplace)."""
    right, every = MEASURED[verdict][alike(verdict, effects, explained)]
    return (right + 1) / (every + 2)


def alike(verdict: Verdict, effects: int, explained: float) -> int:
    """Return the number of the group of answers in `MEASURED`."""
    if verdict == "main_effect":
        return int(explained < MOST)
    return min(max(effects, 1), len(MEASURED[verdict])) - 1
