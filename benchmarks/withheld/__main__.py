"""Answer cases of the benchmark, one a job of Hydra; see docs/withheld.

    python -m benchmarks.withheld case=3 entrant=unmodelled
    python -m benchmarks.withheld -m 'case=range(0,100)' hydra/launcher=joblib hydra.launcher.n_jobs=2
    python -m benchmarks.withheld.table unmodelled out=outputs/withheld

Keys are in conf.yaml. A row is written as its case ends, and the same command goes on where it was stopped.
"""

from __future__ import annotations

import sys
from functools import cache
from pathlib import Path

import hydra
from omegaconf import DictConfig

from benchmarks.withheld.case import Case, cases_of
from benchmarks.withheld.entrant import Entrant
from benchmarks.withheld.row import row
from benchmarks.withheld.score import Row
from benchmarks.withheld.table import rows_of
from unmodelled.base.errors import BadInput
from unmodelled.base.files import write_json


def answer(cases: str, number: int, entrant: Entrant, out: Path, cap: float = 300.0) -> Row | None:
    """Write the row of a case, and return it; None if it was there.

    Args:
        cases: words for the cases.
        number: number of the case among them.
        entrant: who answers.
        out: folder of the benchmark.
        cap: CPU seconds after which the case counts as unanswered.

    Raises:
        BadInput: when there is no such case.
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


@hydra.main(version_base="1.3", config_path=".", config_name="conf")
def main(keys: DictConfig) -> None:
    """Answer the case of the keys."""
    out = Path(keys.out).resolve()
    try:
        who = Entrant.of(str(keys.entrant))
        made = answer(str(keys.cases), int(keys.case), who, out, float(keys.cap))
    except BadInput as fault:  # Hydra would show it as a fault of the program
        print(fault, file=sys.stderr)
        sys.exit(2)
    if made is not None:
        what = made["error"] or f"{made['said']}; truth {made['truth'][:60]}"
        done = sum(1 for _ in rows_of(out, who.name).glob("*.json"))
        print(f"{who.name} {made['case']} ({done} rows): {made['cpu']:.0f} s, {what}", flush=True)


if __name__ == "__main__":
    main()
