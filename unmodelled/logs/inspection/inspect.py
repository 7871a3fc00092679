"""Look at all experiments as logged, and cure what is safe to cure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import groupby
from typing import Protocol

from unmodelled.logs.inspection.counter import counter
from unmodelled.logs.inspection.frozen import frozen
from unmodelled.logs.inspection.signal import Finding, Run, signals_of, spans_of
from unmodelled.logs.inspection.spikes import spikes
from unmodelled.logs.table import Columns
from unmodelled.systems.model import System


class Look(Protocol):
    """A look for one kind of fault in one experiment."""

    def __call__(self, run: Run) -> tuple[Run, list[Finding]]:
        """Return the experiment, cured where that is safe, and the findings."""


#: Looks in their order: jumps of a counter are no spikes.
LOOKS: tuple[Look, ...] = (frozen, counter, spikes)
#: Rounds in which the looks see what others have cured: behind spikes a counter may overflow.
ROUNDS = 3


def inspected(
    system: System, names: Sequence[str], logs: Sequence[Columns]
) -> tuple[list[Columns], list[Finding]]:
    """Look at experiments, and cure their faults where that is safe."""
    signals, found, cured = signals_of(system), list[Finding](), list[Columns]()
    spans = spans_of(signals, [log.values for log in logs])
    for name, log in zip(names, logs, strict=True):
        run, mine = inspect(Run(name, log.values["t"], log.values, signals, spans))
        found += mine
        values = {**run.values, "t": run.t}
        cured.append(replace(log, values=values) if any(each.cured for each in mine) else log)
    return cured, found


def inspect(run: Run) -> tuple[Run, list[Finding]]:
    """Look at one experiment."""
    found = list[Finding]()
    for _ in range(ROUNDS):
        new = list[Finding]()
        for look in LOOKS:
            run, more = look(run)
            new += more
        found += [each for each in new if each.cured]
        if not any(each.cured for each in new):
            return run, [*found, *new]
    return run, [*found, *(each for each in new if not each.cured)]


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
