"""Answer cases of the benchmark, one a job of Hydra; see docs/withheld.

    python -m benchmarks.withheld case=3 entrant=unmodelled
    python -m benchmarks.withheld -m 'case=range(0,100)' hydra/launcher=joblib hydra.launcher.n_jobs=2
    python -m benchmarks.withheld.table unmodelled out=outputs/withheld

Keys are in conf.yaml. A row is written as its case ends, and the same command goes on where it was stopped.
"""

from __future__ import annotations

import sys
from pathlib import Path

import hydra
from omegaconf import DictConfig

from benchmarks.withheld.entrant import Entrant
from benchmarks.withheld.row import answer
from benchmarks.withheld.table import rows_of
from unmodelled.base.errors import BadInput


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
