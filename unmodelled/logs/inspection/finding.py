"""Findings of the looks, and the one sentence for all runs that share one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby


@dataclass(frozen=True)
class Finding:
    """A fault of one channel in one run."""

    kind: str  # such as "spikes"
    channel: str  # name in the system file
    run: str  # id of the experiment
    count: int  # samples, jumps or stretches
    first: float  # time of the first one since the start of the run, s
    what: str  # after the channel's name, with {count} for the number over all runs
    cure: str  # what was done, a main clause; what to do where nothing was done
    cured: bool = True


def sentences(findings: Sequence[Finding]) -> Iterator[str]:
    """Yield one sentence for every channel and kind of fault.

    Examples:
        >>> found = [("run1", 1), ("run2", 2)]
        >>> words = "has {count} spikes", "left out"
        >>> list(sentences([Finding("spikes", "x", run, count, 0.25, *words) for run, count in found]))
        ['x has 3 spikes in run1 and run2 (the first one at t = 0.25 s of run1): left out']
    """

    def key(each: Finding) -> tuple[str, str, bool]:
        return each.channel, each.kind, not each.cured

    for _, group in groupby(sorted(findings, key=key), key=key):
        same = list(group)
        runs = list(dict.fromkeys(each.run for each in same))
        count, first = sum(each.count for each in same), same[0]
        where = f"in {_listed(runs)} (the first one at t = {first.first:.4g} s of {runs[0]})"
        yield f"{first.channel} {first.what.format(count=count)} {where}: {first.cure}"


def _listed(runs: Sequence[str]) -> str:
    if len(runs) > 3:
        return f"{len(runs)} runs"
    return " and ".join(filter(None, [", ".join(runs[:-1]), runs[-1]]))
