"""Compare the runs of a sweep in one table and one figure."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from unmodelled.base.errors import BadInput
from unmodelled.base.files import replacing_folder
from unmodelled.base.ownership import verb
from unmodelled.base.progress import track
from unmodelled.cli.sweep.figure import comparison, horizontal_key
from unmodelled.cli.sweep.metrics import PREFERRED
from unmodelled.cli.sweep.runs import Run, metric_names, read_run, run_folders, swept_keys, table_of
from unmodelled.report.figures.style import save, verbatim


@verb(inside=["runs"])
def compare(runs: Path, metric: str | None, over: str | None, out: Path) -> None:
    """Write a table and a figure of the runs of a sweep (comparison.csv and .svg), and print a summary.

    The table has one row per run: `run` (its folder), the keys of the run, every number of its results
    (`unmodelled.cli.sweep.metrics`), and `failure`, the reason why there are no numbers. The figure shows one
    metric over a swept key. `compare <folder>` is short for `compare runs=<folder>`.

    Args:
        runs: folder of one sweep (outputs/train/2026-01-31_12-00-00) or of several sweeps.
        metric: metric of the vertical axis; null: the main metric of the swept verb.
        over: key of the horizontal axis; null: the swept key with most values, numbers before names.
        out: folder that is new, empty or was made by this verb; replaced as a whole.

    Raises:
        BadInput: when there are no runs, no run has metrics, a file cannot be read, or `metric` or `over` is
            unknown.
    """
    folders = run_folders(runs)
    found = [read_run(folder, runs) for folder in track(folders, len(folders), "reading runs")]
    swept, metrics = swept_keys(found), metric_names(found)
    if not metrics:
        raise BadInput(f"{runs}: no run has metrics; run {found[0].name}: {found[0].failure}")
    table = table_of(found)
    metric = metric or next((name for name in PREFERRED if name in metrics), metrics[0])
    over = over or horizontal_key(table, swept)
    _check(metric, metrics, "metric")
    _check(over, ["run", *swept], "over")
    with verbatim(), replacing_folder(out) as new:
        table.to_csv(new / "comparison.csv", index=False)
        save(comparison(table, swept, metric, over), new / "comparison.svg")
    _say(found, swept, metric)


def _check(name: str, known: Sequence[str], argument: str) -> None:
    if name not in known:
        raise BadInput(f"{argument}: unknown {name!r}, must be one of {', '.join(known)}")


def _say(runs: Sequence[Run], swept: Sequence[str], metric: str) -> None:
    print(f"{len(runs)} runs, swept: {', '.join(swept) or 'nothing'}")
    ranked = sorted((r for r in runs if r.has(metric)), key=lambda run: run.metrics[metric])
    for word, run in (("smallest", ranked[0]), ("largest", ranked[-1])):
        print(f"{word} {metric}: {run.metrics[metric]:.4g}, {_about(run, swept)}")
    for run in runs:
        if run.failure:
            print(f"without metrics: {_about(run, swept)}: {run.failure}", file=sys.stderr)


def _about(run: Run, swept: Sequence[str]) -> str:
    return " ".join([f"run {run.name}", *(f"{key}={run.keys.get(key, 'default')}" for key in swept)])
