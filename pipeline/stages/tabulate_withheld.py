"""Tabulate the diagnoses of withheld cases: tables and metrics."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pandas as pd

from pipeline.chapters.readable import write_chapter, write_metrics, write_table
from pipeline.withheld.answers import answers
from pipeline.withheld.folders import COSTS
from pipeline.withheld.scores import PROTOCOL, calibration, confusion, detection, listed, misses, scores
from unmodelled.base.files import read_json
from unmodelled.base.ownership import verb


@verb()
def tabulate_withheld(
    cases: Path, diagnoses: Path, refits: Path, profile_name: str, out: Path, reports: Path
) -> None:
    """Write tables for figures to `out`, withheld.json and readable tables to `reports`.

    Tables: `cases` (one row per case, see `judging.judged`), `detection` (by level of the effect),
    `calibration` (by confidence), `confusion` (by family), `misses`.

    Args:
        cases: folder of campaigns of withheld cases, one kind per campaign.
        diagnoses: folder written by diagnose_withheld.
        refits: folder written by refit_withheld.
        profile_name: name of the profile that chose the cases.
        out: folder that is new, empty or was made by this verb; replaced as a whole.
        reports: folder whose metrics/withheld.json and tables withheld and withheld_misses are rewritten.

    Raises:
        BadInput: when an input is missing.
    """
    rows = pd.DataFrame(_rows(cases, diagnoses, refits))
    found = {"cases": rows, "detection": detection(rows), "calibration": calibration(rows)}
    found |= {"confusion": confusion(rows), "misses": misses(rows)}
    write_chapter(out, found)
    systems = {str(name): scores(group) for name, group in rows.groupby("system")}
    numbers = {"protocol": PROTOCOL, **scores(rows), "systems": systems}
    write_metrics(reports, "withheld", "virtual", profile_name, numbers)
    tables = reports / "tables"
    write_table(tables / "withheld", listed(rows), None, "Withheld check", PROTOCOL, "virtual")
    title = "Withheld check: every case whose answer is not right"
    write_table(tables / "withheld_misses", found["misses"], None, title, PROTOCOL, "virtual")


def _rows(cases: Path, diagnoses: Path, refits: Path) -> Iterator[dict[str, Any]]:
    for place, _, row in answers(cases, diagnoses, refits):
        cost = read_json(diagnoses / place.parent / COSTS / f"{place.name}.json")
        part = place.parent.parent
        yield {"kind": place.parent.name, "case": (part / place.name).as_posix(), **row, **cost}
