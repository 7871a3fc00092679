"""Tabulate what one more experiment adds to the diagnoses of withheld cases."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pipeline.chapters.leaves import mean_leaf
from pipeline.chapters.readable import write_table
from pipeline.chapters.reported import read_judged
from pipeline.withheld.answers import answer
from pipeline.withheld.folders import cases_in
from pipeline.withheld.judging import Content
from pipeline.withheld.proposals import KINDS
from pipeline.withheld.scores import SHOWN, single
from unmodelled.base.ownership import verb

PROTOCOL = (
    "single effects of 0.3 to 3 typical sizes on virtual machines that share no code with the models; every "
    "further experiment is measured within the ranges of the logs, and the case is diagnosed again; shares "
    "of the cases whose effect a fit that knows it (the oracle) sees in the first logs, 95 % intervals; "
    "width: of the intervals of the first answer's numbers, by that in the first answer, geometric mean"
)


@verb()
def tabulate_proposals(cases: Path, diagnoses: Path, refits: Path, extended: Path, reports: Path) -> None:
    """Write the tables proposals (scores by experiment) and proposals_misses to `reports`/tables.

    Args:
        cases: campaign of withheld cases with single effects.
        diagnoses: folder of the diagnoses of this campaign, written by `diagnose_withheld`.
        refits: folder of the refits of this campaign, written by `refit_withheld`.
        extended: folder that `diagnose_withheld` wrote from that of `propose_withheld`. A case that is
            missing there has its first answer: no such experiment keeps the limits.
        reports: folder whose tables are rewritten.

    Raises:
        BadInput: when an input is missing.
    """
    kinds = ("none", *KINDS)
    every = (row for kind in kinds for row in _rows(kind, cases, diagnoses, refits, extended / kind))
    rows = pd.DataFrame(every)
    by_kind = {kind: rows[rows["experiment"] == kind] for kind in kinds}
    table = pd.DataFrame(
        {"experiment": kind, "measure": name, **_leaf(leaf)}
        for kind, some in by_kind.items()
        for name, leaf in (single(some) | _width(some["width"].dropna())).items()
    )
    missed = rows[rows["seen"] & ~(rows["first"] & (rows["set_size"] <= 1.0))]
    title = "What one more experiment adds"
    write_table(reports / "tables" / "proposals", table, None, title, PROTOCOL, "virtual")
    title += ": every case that is not named first and alone"
    columns = ["experiment", *SHOWN[1:]]
    write_table(reports / "tables" / "proposals_misses", missed[columns], None, title, PROTOCOL, "virtual")


def _leaf(leaf: dict[str, Any]) -> dict[str, Any]:
    low, high = leaf.get("interval", (None, None))
    return {"unit": leaf["unit"], "n": leaf["n"], "value": leaf["value"], "low": low, "high": high}


def _rows(kind: str, cases: Path, diagnoses: Path, refits: Path, extended: Path) -> Iterator[dict[str, Any]]:
    for case in cases_in(cases):
        name = f"{case.name}.json"
        said = extended if (extended / name).exists() else diagnoses
        later, row = answer(case, said / name, refits / name)
        width = _narrowed(read_judged(diagnoses / name), later)
        yield {"experiment": kind, "case": case.name, "width": width, **row}


def _narrowed(first: Content, later: Content) -> float:
    """Width of the intervals of the first answer's numbers in a later answer, by the first: geometric mean.

    Of the numbers of effects that have a finite interval in both; nan if there is none.
    """
    before, after = _widths(first), _widths(later)
    ratios = [after[name] / width for name, width in before.items() if name in after]
    return float(np.exp(np.mean(np.log(ratios)))) if ratios else np.nan


def _widths(said: Content) -> dict[str, float]:
    intervals = {n: v["interval"] for effect in said["effects"] for n, v in effect["parameters"].items()}
    widths = {n: high - low for n, (low, high) in intervals.items() if None not in (low, high)}
    return {name: width for name, width in widths.items() if width > 0.0}


def _width(ratios: pd.Series) -> dict[str, Any]:
    """Leaf of the geometric mean over the cases; none without cases."""
    if not len(ratios):
        return {}
    leaf = mean_leaf(np.log(ratios.to_numpy(np.float64)), "of the first")
    return {"width": leaf | {"value": np.exp(leaf["value"]), "interval": list(np.exp(leaf["interval"]))}}
