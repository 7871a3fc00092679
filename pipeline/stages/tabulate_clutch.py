"""Tabulate chapter 3 from identified distributions: tables, metrics and verdicts on claims."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd

from pipeline.chapters import chapter3, clutch, example
from pipeline.chapters.claims import complete
from pipeline.chapters.readable import equations_of, write_chapter, write_metrics, write_table
from unmodelled.base.files import read_json
from unmodelled.base.ownership import verb
from unmodelled.logs.folder import read_logs
from unmodelled.systems.reader import read_system

IDENTIFIED = ("points", "estimates", "trace", "profiles", "pairs", "replicates")
ASSESSED = ("identified", "accuracy", "monte_carlo", "densities", "sampling", "response")


@verb(inside=["data"])
def tabulate_clutch(
    campaign: str, systems: Path, data: Path, profile_name: str, out: Path, reports: Path
) -> None:
    """Write tables, claims and equations to `out`, chapter3.json and readable tables to `reports`.

    Args:
        campaign: clutch campaign of claims and figures; every other assessed campaign is a stress test.
        systems: folder with the system file <campaign>.yaml.
        data: folder with raw, trajectories, uncertainty and assessments of the campaigns.
        profile_name: name of the profile that the campaigns were assessed with.
        out: folder that is new, empty or was made by this verb; replaced as a whole.
        reports: folder whose metrics/chapter3.json and tables are rewritten.

    Raises:
        BadInput: when an input is missing.
    """
    assessed = {path.parent.name for path in (data / "assessments").glob("[!.]*/assessment.json")}
    others = sorted(assessed - {campaign})
    campaigns = [campaign, *others]
    found = {n: clutch.gathered([(c, data / "uncertainty" / c) for c in campaigns], n) for n in IDENTIFIED}
    found |= {n: clutch.gathered([(c, data / "assessments" / c) for c in campaigns], n) for n in ASSESSED}
    summaries = {c: read_json(data / "uncertainty" / c / "uncertainty.json") for c in campaigns}
    about = {c: read_json(data / "assessments" / c / "assessment.json") for c in campaigns}
    known = read_system(systems / f"{campaign}.yaml")
    logs = read_logs(data / "trajectories" / campaign, known)
    found |= example.tables()
    found["experiments"] = logs.experiments
    found["engagement"] = clutch.engagement(known, logs, about[campaign]["shown"])
    found["currents"] = clutch.currents(logs)
    own = {c: chapter3.numbers(_of(found, c), summaries[c]["simulations"]) for c in campaigns}
    chapter = {"example": example.leaves(), **own[campaign], "stress": {c: own[c] for c in others}}
    chapter["advice"] = {"value": len(summaries[campaign]["advice"]), "text": summaries[campaign]["advice"]}
    kind = str(logs.provenance["data"])
    identified = _of(found, campaign)["identified"]
    rows = complete(chapter3.claims(own[campaign], identified, about[campaign]["samples"]), kind)
    write_chapter(out, found, claims=rows, equations=equations_of(3, known), about=about)
    write_metrics(reports, "chapter3", kind, profile_name, chapter)
    _readable(reports / "tables", own[campaign], about[campaign]["samples"])


def _of(tables: dict[str, pd.DataFrame], campaign: str) -> dict[str, pd.DataFrame]:
    """The rows of one campaign."""
    return {
        name: table[table["campaign"] == campaign].drop(columns="campaign").reset_index(drop=True)
        for name, table in tables.items()
        if "campaign" in table
    }


def _readable(folder: Path, found: dict[str, Any], samples: int) -> None:
    write_table(
        folder / "table_3_1",
        pd.DataFrame(chapter3.TABLE_3_1, columns=["distribution", "polynomials", "support"]),
        3,
        "Table 3.1: Wiener-Askey polynomial chaos, the families that can be chosen",
        "of the standard variable; the clipped normal is mapped to a Gaussian (eq. 3.12) or has polynomials "
        "of its own",
    )
    write_table(
        folder / "table_3_2",
        chapter3.table_3_2(found),
        3,
        "Table 3.2: Log-likelihood estimation, ours beside the dissertation's",
        f"MAE of the log-likelihood of 108 points against {samples} samples; S: simulations a point that "
        "reach it. Ours is a virtual bench with invented parameters: only relations between the rows compare",
    )
