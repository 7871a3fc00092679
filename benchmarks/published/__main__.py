"""Learn from the training records of public data sets, and simulate their official tests.

    python -m benchmarks.published silverbox=ZIP cascaded_tanks=ZIP emps=FOLDER out=FOLDER method=ours

method: ours (default), or the black boxes subnet and nl_lfr. docs/withheld/published.md has the table beside
published methods.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.published import black_boxes, ours
from benchmarks.published.records import SETS
from unmodelled.base.errors import BadInput
from unmodelled.base.files import write_json

METHODS = {"ours": ours.rows, "subnet": black_boxes.subnet, "nl_lfr": black_boxes.nl_lfr}


def main(words: Sequence[str]) -> None:
    """Write out/<set>_<method>.json, and print the rows, for every set that is given."""
    given = dict(word.partition("=")[::2] for word in words)
    method, out = given.pop("method", "ours"), given.pop("out", "")
    if method not in METHODS or not out or not given or not {*given} <= {*SETS}:
        sets, methods = ", ".join(SETS), "|".join(METHODS)
        raise BadInput(f"words: give out=FOLDER, the path of one or more of {sets}, and method={methods}")
    for name, path in given.items():
        records = SETS[name](path)
        rows = []
        for row in METHODS[method](records):
            rows.append({**row, "unit": records.unit})
            print(f"{row['model']}, {row['cpu']:.0f} CPU s, RMSE in {records.unit}:")
            print("  " + ", ".join(f"{test} {error:.4g}" for test, error in row["rmse"].items()))
            for law in row.get("laws", ()):
                print(f"  {law}", flush=True)
        write_json(Path(out) / f"{name}_{method}.json", rows)


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except BadInput as fault:
        sys.exit(str(fault))
