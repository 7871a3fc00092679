"""Look at all experiments as logged, and cure what is certain."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Protocol

from unmodelled.logs.inspection.clipped import Ends, clipped
from unmodelled.logs.inspection.counter import counter
from unmodelled.logs.inspection.frozen import frozen
from unmodelled.logs.inspection.register import register
from unmodelled.logs.inspection.signal import Finding, Run, signals_of, spans_of
from unmodelled.logs.inspection.spikes import spikes
from unmodelled.logs.table import Columns
from unmodelled.logs.time_units import on_clock
from unmodelled.systems.model import System


class Look(Protocol):
    """A look for one kind of fault in all experiments: what is cured, is cured alike in all of them."""

    def __call__(self, runs: Sequence[Run]) -> tuple[list[Run], list[Finding]]:
        """Return the experiments, cured where that is certain, and the findings."""


#: Looks in their order: jumps of a counter are no spikes, and those of a register no counter.
LOOKS: tuple[Look, ...] = (register, frozen, counter, spikes)
#: Rounds in which the looks see what others have cured: behind spikes a counter may overflow.
ROUNDS = 3
#: Words of a count of one.
ONCE = {" 1 times": " once", " 1 spikes": " a spike", " 1 samples": " 1 sample"}
#: What was done where a mapping turns cures off.
OFF = "nothing was changed, as the mapping says cure: false"


@dataclass(frozen=True)
class Inspected:
    """Experiments after the looks."""

    logs: list[Columns]
    found: list[Finding]
    limits: dict[str, Ends]  # ends of the ranges of outputs by name, SI: samples there are not compared


def inspected(system: System, names: Sequence[str], logs: Sequence[Columns], cure: bool = True) -> Inspected:
    """Look at experiments, and cure their faults where that is certain and wanted."""
    signals = signals_of(system)
    spans = spans_of(signals, [log.values for log in logs])
    runs = [
        Run(name, log.values["t"], log.values, signals, spans) for name, log in zip(names, logs, strict=True)
    ]
    seen, found, ends = inspect(runs)
    if not cure:
        return Inspected([*logs], [replace(each, cure=OFF, cured=False) for each in found], {})
    cured = [
        log if new is old else replace(log, values={**new.values, "t": new.t})
        for log, old, new in zip(logs, runs, seen, strict=True)
    ]
    limits = {o.name: ends[o.column] for o in system.outputs if o.column in ends}
    return Inspected(cured, found, limits)


def inspect(runs: Sequence[Run]) -> tuple[list[Run], list[Finding], dict[str, Ends]]:
    """Look at experiments; return them cured, the findings, and the ends of ranges by column."""
    found, left, runs = list[Finding](), list[Finding](), list(runs)
    for _ in range(ROUNDS if runs and runs[0].signals else 0):
        new = list[Finding]()
        for look in LOOKS:
            runs, more = look(runs)
            new += more
        found += [each for each in new if each.cured]
        left = [each for each in new if not each.cured]
        if len(left) == len(new):
            break
    runs, more, ends = clipped(runs) if runs and runs[0].signals else (runs, [], {})
    return runs, [*found, *left, *more], ends


def sentences(findings: Sequence[Finding], clock: str = "s") -> Iterator[str]:
    """Yield one sentence for every channel and kind of fault; places in the unit of the clock.

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
        where = f"in {_listed(runs)} (the first one at t = {on_clock(first.first, clock)} of {runs[0]})"
        what = first.what.format(count=count)
        for several, one in ONCE.items():
            what = what.replace(several, one)
        yield f"{first.channel} {what} {where}: {first.cure}"


def _listed(runs: Sequence[str]) -> str:
    if len(runs) > 3:
        return f"{len(runs)} runs"
    return " and ".join(filter(None, [", ".join(runs[:-1]), runs[-1]]))
