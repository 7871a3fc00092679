"""Look at all experiments as logged, and cure what is safe to cure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

from unmodelled.logs.inspection.counter import counter
from unmodelled.logs.inspection.finding import Finding
from unmodelled.logs.inspection.frozen import frozen
from unmodelled.logs.inspection.signal import Run, signals_of, spans_of
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
