"""One case of the benchmark and its row."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from benchmarks.withheld.case import Case, cases_of
from benchmarks.withheld.entrant import Entrant
from benchmarks.withheld.row import row
from benchmarks.withheld.score import Row
from benchmarks.withheld.table import rows_of
from unmodelled.base.errors import BadInput
from unmodelled.base.files import write_json


def answer(cases: str, number: int, entrant: Entrant, out: Path, cap: float = 300.0) -> Row | None:
    """Write the row of a case, by its number among `cases`, and return it; None if it was there.

    After `cap` CPU seconds the case counts as unanswered.
    """
    every = _drawn(cases, out)
    if not 0 <= number < len(every):
        raise BadInput(f"case: must be 0 to {len(every) - 1} of {cases}, got {number}")
    case = every[number]
    path = rows_of(out, entrant.name) / f"{case.name}.json"
    if path.exists():
        return None
    case.make()
    made = row(case, entrant, out / "answers" / entrant.name, cap)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_json(path, made)
    return made


@cache
def _drawn(cases: str, out: Path) -> list[Case]:
    """The cases, drawn once in a process that answers several."""
    return cases_of(cases, out)
