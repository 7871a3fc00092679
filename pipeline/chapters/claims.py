"""The dissertation's headline claims about the cam-follower, with verdicts from the computed numbers."""

from typing import Any

import numpy as np
import pandas as pd

from pipeline.chapters import published
from pipeline.chapters.summary import per_repeat
from pipeline.chapters.verdicts import (
    ALIKE,
    DIRECTION,
    FAILS,
    HOLDS,
    UNTESTED,
    alike_verdict,
    order_verdict,
    worst,
)

Row = dict[str, Any]

#: Accuracy from which F-dagger separates contact from jump.
SEPARATED = 0.95


def row(chapter: int, id_: str, page: str, claim: str, **rest: Any) -> Row:
    """Return the row of a claim."""
    return {"id": id_, "chapter": chapter, "page": page, "claim": claim, **rest}


def geometry_and_labels(metrics: dict[str, Any], cells: tuple[int, int], data: str) -> list[Row]:
    """Return the claims of sections 5.2, 5.3 and 6.5 about geometry, labels and F-dagger."""
    equal, total = cells
    contact, accuracy = metrics["contact"], metrics["f_dagger"]["accuracy"]
    trivial = max(metrics[k]["value"] for k in ("contact", "jump")) / accuracy["n"]
    lowest = accuracy["interval"][0]
    separated = HOLDS if lowest > SEPARATED else DIRECTION if lowest > trivial else FAILS
    counted = HOLDS if contact["value"] == published.NOMINAL else FAILS
    return [
        {
            "id": "table_5_1",
            "chapter": 5,
            "page": "table 5.1",
            "claim": "Curvature and pressure angle of the twenty cams",
            "dissertation": total,
            "ours": equal,
            "unit": "cells equal",
            "protocol": "geometry only; 5.1a divided by the roller's radius",
            "verdict": HOLDS if equal == total else FAILS,
        },
        {
            "id": "nominal_count",
            "chapter": 6,
            "page": "section 6.5",
            "claim": "754 of 1600 trajectories keep contact",
            "dissertation": published.NOMINAL,
            "ours": contact["value"],
            "unit": "runs",
            "protocol": "mean per-revolution maximum of eps at most 1.3 % of H; below 1.5 turns a stall",
            "verdict": counted if data == "measured" else UNTESTED,
        },
        {
            "id": "f_dagger_separates",
            "chapter": 5,
            "page": "fig. 5.11",
            "claim": "F-dagger separates contact from jump",
            "dissertation": None,
            "ours": accuracy["value"],
            "interval": accuracy["interval"],
            "unit": "-",
            "protocol": f"{metrics['f_dagger']['protocol']}; holds where the lower 95 % limit of the "
            f"accuracy is above {SEPARATED:.0%}, in direction where it is above the share of the more "
            "frequent label",
            "verdict": separated,
        },
    ]


def simulation(errors: pd.DataFrame) -> list[Row]:
    """Return the claims of sections 6.5.1, 6.5.2 and 6.4.5 about errors of free runs."""
    inside = {m: per_repeat(g) for m, g in errors[errors["split"] == "interpolation"].groupby("model")}
    first = errors[(errors["split"] == "extrapolation") & (errors["fold"] == "10%")]
    outside = {m: per_repeat(g) for m, g in first.groupby("model")}
    networks = [inside[m] for m in ("f_bb", "f_h1", "f_h2")]
    alike, spread, limits = alike_verdict(networks)
    order = (("f_bb", "f_h1"), ("f_h1", "f_h2"))
    return [
        {
            "id": "interpolation_alike",
            "chapter": 6,
            "page": "section 6.5.1",
            "claim": "The three ReLU-ODE models are about equally accurate when interpolating",
            "dissertation": "approximately the same",
            "ours": spread,
            "interval": limits,
            "unit": "worst / best median MSE",
            "protocol": "5 folds, each without two neighbouring subsets; free run from the measured initial "
            "state; median over all test runs, interval from the 95 % intervals of both models over repeats; "
            f"holds where the upper limit is below {ALIKE}, in direction where only the value is",
            "verdict": alike,
        },
        {
            "id": "extrapolation_hybrids",
            "chapter": 6,
            "page": "section 6.5.2",
            "claim": "Trained on the 10 % most stable runs, f_H2 beats f_H1 and f_H1 beats f_BB",
            "dissertation": "f_H2 < f_H1 < f_BB",
            "ours": ", ".join(f"{m} {np.median(outside[m]):.2f}" for m in ("f_bb", "f_h1", "f_h2")),
            "unit": "(rad/s)^2",
            "protocol": "trained on I_1, free run on I_9 and I_10, median over runs, tested over repeats",
            "verdict": worst(*(order_verdict(outside[more], outside[less]) for more, less in order)),
        },
        {
            "id": "linear_fails",
            "chapter": 6,
            "page": "section 6.4.5",
            "claim": "A linear model fails, which justifies a network",
            "dissertation": "fails",
            "ours": float(np.median(inside["lls"]) / max(np.median(own) for own in networks)),
            "unit": "linear / worst network, median MSE",
            "protocol": "5-fold interpolation; least squares have no scatter: the repeats of each network "
            "are tested against this one number, the worst verdict",
            "verdict": worst(*(order_verdict(inside["lls"], own) for own in networks)),
        },
    ]


def boundary(errors: pd.DataFrame) -> list[Row]:
    """Return the claim of section 6.5.4: with the 10 % most stable data, f_H2 predicts the boundary best."""
    first = errors[errors["fold"] == "10%"]
    mae = {str(m): g["mae"].to_numpy() for m, g in first.groupby("model")}
    order = [order_verdict(mae[other], mae["f_h2"]) for other in ("f_bb", "f_h1", "direct")]
    return [
        {
            "id": "boundary_best_h2",
            "chapter": 6,
            "page": "fig. 6.24",
            "claim": "From the 10 % most stable data f_H2 finds the boundary Q best, far better than "
            "extrapolating F_min",
            "dissertation": "f_H2 < f_H1 < f_BB < direct",
            "ours": ", ".join(
                f"{m} {np.median(mae[m]):.2f}" for m in ("direct", "f_bb", "f_h1", "f_h2", "motor", "best")
            ),
            "unit": "V",
            "protocol": "trained on I_1; every setting of the grid simulated from standstill; mean absolute "
            "error of the voltage at which F_min reaches zero, over the settings with a measured boundary; "
            "tested over repeats, the direct extrapolation is one number",
            "verdict": worst(*order),
        }
    ]


def complete(rows: list[Row], data: str) -> list[Row]:
    """Add missing keys to the rows of claims."""
    return [{"interval": None, "data": data, **row} for row in rows]
