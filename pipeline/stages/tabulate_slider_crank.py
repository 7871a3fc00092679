"""Tabulate chapter 4 from predictions: tables, metrics and verdicts on claims."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pipeline.chapters import chapter4
from pipeline.chapters import slider_crank as tables
from pipeline.chapters.claims import complete
from pipeline.chapters.readable import (
    equations_of,
    write_chapter,
    write_metrics,
    write_table,
)
from unmodelled.base.files import read_json
from unmodelled.base.ownership import verb
from unmodelled.base.parquet import read_parquet
from unmodelled.learning.closed_form import closed_form
from unmodelled.logs.folder import read_logs
from unmodelled.systems.reader import read_system


@verb(inside=["data"])
def tabulate_slider_crank(system: Path, data: Path, profile_name: str, out: Path, reports: Path) -> None:
    """Write tables, claims and equations to `out`, chapter4.json and readable tables to `reports`.

    Args:
        system: system file of the slider-crank.
        data: folder with raw, trajectories, fits, predictions and identifiability of the campaigns
            slider_crank and slider_crank_bare (without spring).
        profile_name: name of the profile that the models were trained with.
        out: folder that is new, empty or was made by this verb; replaced as a whole.
        reports: folder whose metrics/chapter4.json and tables are rewritten.

    Raises:
        BadInput: when an input is missing.
    """
    known = read_system(system)
    logs = {name: read_logs(data / "trajectories" / name, known) for name in tables.CAMPAIGNS}
    found = _tables(known, logs, data)
    formula = _formula(found["force"])
    advice = read_json(data / "identifiability" / "slider_crank" / "identifiability.json")["advice"]
    fits = data / "fits" / "slider_crank"
    free = read_parquet(fits / "hybrid_free" / "leave_one_out" / "history.parquet")
    spring = found["spring"]
    chapter = chapter4.accuracy(found["errors"]) | {
        "recovered": chapter4.recovered(
            tables.spring_errors(found["force"], spring), float(np.ptp(spring["F"]))
        ),
        "parameters": chapter4.parameter_errors(free, found["parameters"]),
        "identifiability": {"advice": {"value": len(advice), "unit": "sentences", "text": advice}},
    }
    kind = str(logs["slider_crank"].provenance["data"])
    rows = complete(chapter4.claims(chapter, found["errors"], found["history"], advice), kind)
    write_chapter(out, {**found, "closed_form": formula}, claims=rows, equations=equations_of(4, known))
    write_metrics(reports, "chapter4", kind, profile_name, chapter)
    _readable(reports / "tables", found["parameters"], free, chapter)


def _tables(known: Any, logs: dict[str, Any], data: Path) -> dict[str, pd.DataFrame]:
    names = tables.CAMPAIGNS
    raw = data / "raw" / "slider_crank"
    fits, predictions = data / "fits" / "slider_crank", data / "predictions" / "slider_crank"
    measured = {c: tables.signals(known, logs[n]) for n, c in names.items()}
    errors = tables.gathered(predictions, fits, "errors")
    history, timing = tables.histories(fits)
    study = data / "identifiability" / "slider_crank"
    return {
        "spring": pd.read_csv(raw / "spring.csv"),
        "experiments": pd.concat([tables.experiments(logs[n]).assign(campaign=c) for n, c in names.items()]),
        "signals": pd.concat([table.assign(campaign=c) for c, table in measured.items()]),
        "errors": errors[errors["state"] == "omega"].drop(columns="state"),
        "examples": tables.gathered(predictions, fits, "examples"),
        "timing": timing,
        "history": history,
        "parameters": tables.parameters(known, raw / "bench.json"),
        "force": tables.forces(
            {c: data / "predictions" / n for n, c in names.items()},
            measured,
            {c: data / "raw" / n / "truth.parquet" for n, c in names.items()},
        ),
        "surface": tables.surface(predictions / "hybrid_free" / "leave_one_out"),
        **{
            name: read_parquet(study / f"{name}.parquet") for name in ("sensitivity", "correlation", "advice")
        },
    }


def _formula(force: pd.DataFrame) -> pd.DataFrame:
    """The learned force against a closed-form expression of it."""
    chosen = force[(force["campaign"] == "spring") & (force["model"] == "nnap")]
    d, v, F = (chosen[name].to_numpy() for name in ("d", "v", "F"))
    found = closed_form(d, v, F, pd.factorize(chosen["id"])[0], ("d", "v"))
    return pd.DataFrame({"d": d, "v": v, "F": F, "F_formula": found(d, v), "formula": found.text})


def _readable(folder: Path, known: pd.DataFrame, free: pd.DataFrame, chapter: dict[str, Any]) -> None:
    last = free[free["epoch"] == free["epoch"].max()]
    rows = []
    for row in known.itertuples():
        identified = last[row.parameter] if row.parameter in last else pd.Series([np.nan])
        numbers = (row.truth, identified.median(), identified.min(), identified.max())
        rows.append((row.parameter, row.meaning, row.unit, *numbers))
    columns = ["parameter", "meaning", "unit", "bench", "identified", "lowest", "highest"]
    protocol = (
        "identified with the network from starts +-50 %, median and range over twenty leave-one-out folds; "
        "parameters without numbers were held at the system file's values, which are the bench's"
    )
    write_table(
        folder / "table_4_1", pd.DataFrame(rows, columns=columns), 4, "Table 4.1: parameters", protocol
    )
    errors = [
        (model, *(leaves["rmse"][k] for k in ("value", "unit")), *leaves["rmse"]["interval"])
        for model, leaves in chapter["loocv"].items()
    ]
    table = pd.DataFrame(errors, columns=["model", "rmse", "unit", "low", "high"]).sort_values("rmse")
    write_table(folder / "slider_crank", table, 4, "Held-out RMSE of omega", chapter["protocol"])
