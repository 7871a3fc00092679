"""Taking times that can be compared: ours and the peer's in turn, the median of the ratios."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable


class PeerMissing(Exception):
    """The peer of a benchmark is not installed; the message says how to get it."""


def side_by_side(
    ours: Callable[[], object], peer: Callable[[], object], rounds: int = 5, steps: int = 1
) -> dict[str, float]:
    """Seconds of both and the ratio peer / ours; both run once before the clock starts.

    One call of `ours` does the work of `steps` calls of `peer`; the seconds are those of one.
    """
    ours(), peer()
    return compared([(seconds(ours) / steps, seconds(peer)) for _ in range(rounds)])


def compared(pairs: list[tuple[float, float]]) -> dict[str, float]:
    """Medians of pairs (ours, peer) of seconds, and of their ratios peer / ours."""
    ratios = [b / a for a, b in pairs]
    return {
        "ours": statistics.median(a for a, _ in pairs),
        "peer": statistics.median(b for _, b in pairs),
        "ratio": statistics.median(ratios),
        "ratio_low": min(ratios),
        "ratio_high": max(ratios),
    }


def seconds(work: Callable[[], object]) -> float:
    """Wall-clock seconds of one call."""
    start = time.perf_counter()
    work()
    return time.perf_counter() - start
