"""Tabulate chapter 5 from predicted follower jumps: tables, metrics and verdicts on claims."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd

from pipeline.chapters import chapter5
from pipeline.chapters.claims import complete
from pipeline.chapters.readable import write_chapter, write_metrics, write_table
from pipeline.splits import fold_named
from unmodelled.base.campaign import Campaign
from unmodelled.base.errors import BadInput
from unmodelled.base.ownership import verb
from unmodelled.base.parquet import read_parquet
from unmodelled.learning.splits import Split

PREDICTED = ("runs", "repeats", "examples")
EXPLAINED = ("shares", "overall", "accuracy", "phi", "explained", "points", "exact", "agreement")


@verb()
def tabulate_jumps(
    features: Path,
    predictions: Path,
    attributions: Path,
    split: Split,
    profile_name: str,
    out: Path,
    reports: Path,
) -> None:
    """Write tables for figures and claims.json to `out`, chapter5.json and a readable table to `reports`.

    Every table has a column `model` (tau1 to tau4; tau1_blind to tau4_blind, the models without q_s; bounce;
    tau4_bounce). Tables of predictions also have `split` (uniform, factors; scarce for the models without
    q_s) and `fold` (1% to 50%; H, beta, m), and hold the test runs:

    - runs: exp, label, mse (mm^2, of the median prediction over the repeats), measured and predicted (mean
      over revolutions of the largest detachment, m), jumps (whether the prediction counts as a jump): Fig.
      5.16 to 5.18;
    - repeats: repeat, exp, label, mse, predicted, jumps of every repeat;
    - examples: exp, label, t (s), measured, predicted, low and high of the repeats (m): Fig. 5.15 and 5.21.

    Tables of attributions are of the fold 30% and described in `attribute`: phi and explained (Fig. 5.22, the
    runs of examples, step k at time t = 0.01 k), shares and overall (Fig. 5.23), points (Fig. 5.23.2),
    accuracy, exact and agreement.

    Args:
        features: store written by featurize.
        predictions: folder with <model>/<split>/ as written by evaluate.
        attributions: folder written by attribute.
        split: uniform split, for F-dagger as a classifier.
        profile_name: name of the profile that the models were trained with.
        out: folder that is new, empty or was made by this verb; replaced as a whole.
        reports: folder whose metrics/chapter5.json and tables/jumps are rewritten.

    Raises:
        BadInput: when an input is missing.
    """
    campaign = Campaign.read(features, ["t"])
    found = {kind: _gather(predictions, kind) for kind in PREDICTED}
    found |= {kind: read_parquet(attributions / f"{kind}.parquet") for kind in EXPLAINED}
    chapter = _chapter(found, campaign.experiments, split)
    data = str(campaign.provenance["data"])
    rows = complete(chapter5.claims(found["repeats"], found["overall"]), data)
    write_chapter(out, found, claims=rows)
    write_metrics(reports, "chapter5", data, profile_name, chapter)
    write_table(
        reports / "tables" / "jumps",
        chapter5.readable(found["runs"]),
        5,
        "Prediction of follower jumps",
        chapter5.COMMON,
    )


def _chapter(found: dict[str, pd.DataFrame], experiments: pd.DataFrame, split: Split) -> dict[str, Any]:
    """Return the numbers of chapter5.json; `split` is the uniform one, for F-dagger as a classifier."""
    chapter = chapter5.predictions(found["runs"])
    scarce = fold_named(split.folds(experiments), chapter5.SCARCE)
    accuracy = chapter5.force_accuracy(experiments.iloc[scarce.test])
    chapter["baseline"]["f_dagger"] = {"accuracy": accuracy}
    return {**chapter, "attribution": chapter5.attribution(found)}


def _gather(predictions: Path, kind: str) -> pd.DataFrame:
    files = sorted(predictions.glob(f"[!.]*/[!.]*/{kind}.parquet"))
    if not files:
        raise BadInput(f"{predictions}: no */*/{kind}.parquet")
    found = pd.concat([read_parquet(f).assign(trained=f.parts[-2]) for f in files], ignore_index=True)
    return found.assign(split=chapter5.splits(found["trained"], found["fold"])).drop(columns="trained")
