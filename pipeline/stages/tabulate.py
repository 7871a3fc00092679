"""Tabulate chapter 6 from predictions: tables, metrics and verdicts on claims."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pipeline.cam_follower.cam_follower import CamFollower
from pipeline.chapters import boundary, claims, summary
from pipeline.chapters.readable import write_chapter, write_metrics, write_table
from pipeline.splits import nominal_subsets
from unmodelled.base.campaign import Campaign
from unmodelled.base.errors import BadInput
from unmodelled.base.ownership import verb
from unmodelled.base.parquet import read_parquet
from unmodelled.base.progress import track
from unmodelled.learning.splits import Fold, Split

PROTOCOL = (
    "nominal runs sorted by measured F_min into I_1 to I_10; free run from the measured initial state; "
    "MSE of omega projected on the angle, median over the test runs, no run left out, an angle never "
    "reached counts as standstill; interval: 95 % over repeats"
)
GRID = ["exp", "H", "beta", "m", "V"]


@verb()
def tabulate(
    features: Path,
    predictions: Path,
    tuning: Path,
    mechanism: CamFollower,
    split: Split,
    profile_name: str,
    out: Path,
    reports: Path,
) -> None:
    """Write tables for figures and claims.json to `out`, metrics and readable tables to `reports`.

    Args:
        features: store written by featurize.
        predictions: folder with <model>/<split>/ as written by evaluate.
        tuning: folder with <model>.parquet as written by tune.
        mechanism: constants of the bench.
        split: extrapolation split, for the direct baseline.
        profile_name: name of the profile that the models were trained with.
        out: folder that is new, empty or was made by this verb; replaced as a whole.
        reports: folder whose metrics and tables are rewritten.

    Raises:
        BadInput: when an input is missing.
    """
    campaign = Campaign.read(features, ["t"])
    data = str(campaign.provenance["data"])
    experiments = campaign.experiments.assign(subset=_subsets(campaign.experiments))
    errors, examples, force = (_gather(predictions, kind) for kind in ("errors", "examples", "force"))
    force = pd.concat([force, _direct(experiments, split.folds(experiments))], ignore_index=True)
    lines = _boundaries(force, experiments, mechanism)
    tables = {"experiments": experiments, "errors": errors, "examples": examples, "force": force}
    tables |= {"boundary": lines, "tuning": _tuning(tuning)}
    cells = summary.table_5_1(lambda H, beta: mechanism.cam(H, beta).extremes())
    equal = int((cells["ours"] == cells["dissertation"]).sum())
    labels = summary.labels(experiments)
    labels["table_5_1"] = {"cells_equal": {"value": equal, "unit": "cells", "n": len(cells)}}
    mae = summary.boundary_errors(lines)
    chapter = summary.simulation(errors) | {
        "f_min": summary.contact_force(force, experiments),
        "boundary": summary.boundary_leaves(mae),
        "protocol": PROTOCOL,
    }
    write_metrics(reports, "cam_labels", data, profile_name, labels)
    write_metrics(reports, "chapter6", data, profile_name, chapter)
    rows = claims.geometry_and_labels(labels, (equal, len(cells)), data) + claims.simulation(errors)
    write_chapter(out, tables, claims=claims.complete(rows + claims.boundary(mae), data))
    _readable(reports / "tables", cells, chapter)


def _subsets(experiments: pd.DataFrame) -> np.ndarray[tuple[int, ...], np.dtype[np.int64]]:
    """1 to 10 for the contact runs, from stable to unstable; 0 for the others."""
    subset = np.zeros(len(experiments), np.int64)
    for number, rows in enumerate(nominal_subsets(experiments), start=1):
        subset[rows] = number
    return subset


def _gather(predictions: Path, kind: str) -> pd.DataFrame:
    files = sorted(predictions.glob(f"[!.]*/[!.]*/{kind}.parquet"))
    if not files:
        raise BadInput(f"{predictions}: no */*/{kind}.parquet")
    tables = [read_parquet(f).assign(model=f.parts[-3], split=f.parts[-2]) for f in files]
    return pd.concat(tables, ignore_index=True)


def _direct(experiments: pd.DataFrame, folds: list[Fold]) -> pd.DataFrame:
    """The baseline of section 6.3.3 in the form of a model's predictions."""
    tables = []
    for fold in folds:
        f_min = boundary.extrapolate_force(experiments.iloc[fold.train], experiments)
        tables.append(
            pd.DataFrame({"fold": fold.name, "repeat": 0, "exp": experiments["exp"], "f_min": f_min})
        )
    return pd.concat(tables, ignore_index=True).assign(model="direct", split="extrapolation")


def _boundaries(force: pd.DataFrame, experiments: pd.DataFrame, mechanism: CamFollower) -> pd.DataFrame:
    truth = boundary.measured(experiments, mechanism.jump_share).assign(model="measured", fold="", repeat=0)
    tables = [truth]
    predicted = force.groupby(["model", "fold", "repeat"])
    for (model, fold, repeat), group in track(predicted, len(predicted), "finding boundaries"):
        points = experiments[GRID].merge(group[["exp", "f_min"]], on="exp")
        Q = boundary.predicted(points, points["f_min"].to_numpy())
        tables.append(Q.assign(model=model, fold=fold, repeat=repeat))
    return pd.concat(tables, ignore_index=True)


def _tuning(folder: Path) -> pd.DataFrame:
    return pd.concat([read_parquet(f).assign(model=f.stem) for f in sorted(folder.glob("*.parquet"))])


def _readable(folder: Path, cells: pd.DataFrame, chapter: dict[str, Any]) -> None:
    write_table(
        folder / "table_5_1", cells, 5, "Table 5.1: geometry of the cams", "geometry only, nothing measured"
    )
    rows = [
        (level, model, name, *(content[k] for k in ("value", "unit")), *content.get("interval", (None, None)))
        for level, models in chapter["extrapolation"].items()
        for model, leaves in (models | {}).items()
        for name, content in [*leaves.items(), *chapter["boundary"][level].get(model, {}).items()]
    ]
    columns = ["subsets in training", "model", "quantity", "value", "unit", "low", "high"]
    table = pd.DataFrame(rows, columns=columns).replace({"mae": "Q_mae"})
    write_table(
        folder / "extrapolation",
        table,
        6,
        "Extrapolation to the runs next to the boundary",
        chapter["protocol"],
    )
    rows = [
        (model, name, content["value"], content["unit"], *content.get("interval", (None, None)))
        for model, leaves in chapter["interpolation"].items()
        for name, content in leaves.items()
    ]
    table = pd.DataFrame(rows, columns=["model", "quantity", "value", "unit", "low", "high"])
    write_table(folder / "interpolation", table, 6, "Five-fold interpolation", chapter["protocol"])
