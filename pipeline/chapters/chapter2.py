"""Numbers of the tutorial (chapter 2), and verdicts on its claims."""

from typing import Any

import numpy as np
import pandas as pd
from scipy.spatial import ConvexHull, Delaunay

from pipeline.chapters.claims import Row
from pipeline.chapters.leaves import spread_leaf
from pipeline.chapters.verdicts import order_verdict
from unmodelled.base.arrays import Array, Mask

STATIC = (
    "virtual motor at 200 V; both models fitted to the same samples; RMSE against the noise-free efficiency; "
    "networks of {n} seeds with the penalty of Eq. 2.6, tested against the physics, whose fit has no scatter"
)
DYNAMIC = (
    "virtual pendulum with dry friction, which the physics leaves out; trained on small torques; free run of "
    "4 s from the measured first state; RMSE of the angle; {n} runs held out, median over networks of "
    "different seeds, tested over the pairs of these runs"
)


class Region:
    """Convex hull of explored states (samples, 2) in a plane; `outline` (corners, 2) is counterclockwise."""

    def __init__(self, states: Array) -> None:
        self.outline: Array = states[ConvexHull(states).vertices]
        self._inside = Delaunay(self.outline)

    def holds(self, states: Array) -> Mask:
        """Tell whether the region contains states. Takes states (..., 2); gives (...,)."""
        return np.asarray(self._inside.find_simplex(states) >= 0)


def curve_errors(curves: pd.DataFrame, lowest: float, highest: float) -> pd.DataFrame:
    """Return errors against the true efficiency inside and outside the measured currents (A)."""
    inside = curves["current"].between(lowest, highest)
    rows = curves.assign(
        region=np.where(inside, "inside", "outside"), square=(curves["efficiency"] - curves["truth"]) ** 2
    )
    means = rows.groupby(["model", "seed", "region"])["square"].mean()
    return np.sqrt(means).rename("rmse").reset_index()


def numbers(
    motor: dict[str, float], static: pd.DataFrame, sizes: pd.DataFrame, dynamic: pd.DataFrame
) -> dict[str, Any]:
    """Return the numbers of the chapter: motor, efficiency, sizes and pendulum."""
    found: dict[str, Any] = {
        "motor": {
            "resistance": {"value": motor["resistance"], "unit": "Ohm"},
            "friction": {"value": motor["friction"], "unit": "A/V"},
        },
        "efficiency": {},
        "sizes": {},
        "pendulum": {},
    }
    for (region, model), group in static.groupby(["region", "model"]):
        rmse = group["rmse"].to_numpy(np.float64)
        leaf = spread_leaf(rmse, "-") if len(rmse) > 1 else {"value": float(rmse[0]), "unit": "-", "n": 1}
        found["efficiency"].setdefault(region, {})[model] = {"rmse": leaf}
    for (penalty, hidden), group in sizes.groupby(["penalty", "hidden"]):
        own = {name: spread_leaf(group[name], "-") for name in ("training", "new")}
        found["sizes"].setdefault(f"penalty {penalty:g}", {})[f"{hidden} neurons"] = own
    for (region, model), runs in per_run(dynamic).groupby(["group", "model"]):
        found["pendulum"].setdefault(region, {})[model] = {"rmse": spread_leaf(runs["rmse"], "rad")}
    return found


def per_run(dynamic: pd.DataFrame) -> pd.DataFrame:
    """Return the median error over the trainings: columns group, model, id and rmse (rad)."""
    return dynamic.groupby(["group", "model", "id"])["rmse"].median().reset_index()


def claims(static: pd.DataFrame, dynamic: pd.DataFrame) -> list[Row]:
    """Return the claims of chapter 2 with their verdicts."""
    return [
        _static(static, "inside", "Between the measured currents a network predicts the efficiency better"),
        _static(static, "outside", "Beyond the measured currents a network fails, and the physics does not"),
        _dynamic(dynamic, "explored", "In the explored region a black-box model predicts better"),
        _dynamic(dynamic, "unseen", "Beyond it a black-box model fails, and the physics stays robust"),
    ]


def _row(id_: str, page: str, claim: str, ratio: float, protocol: str, verdict: str) -> Row:
    return {
        "id": id_,
        "chapter": 2,
        "page": page,
        "claim": claim,
        "dissertation": "network better" if claim.endswith("better") else "network worse",
        "ours": ratio,
        "unit": "RMSE of the network by that of the physics",
        "protocol": protocol,
        "verdict": verdict,
    }


def _static(errors: pd.DataFrame, region: str, claim: str) -> Row:
    own = errors[errors["region"] == region]
    rmse = {str(model): group["rmse"].to_numpy() for model, group in own.groupby("model")}
    ratio = rmse["network"] / rmse["physics"][0]
    pair = (rmse["physics"], rmse["network"])
    verdict = order_verdict(*(pair if region == "inside" else pair[::-1]))
    page = "section 2.3.1, fig. 2.9"
    protocol = STATIC.format(n=len(ratio))
    return _row(f"static_{region}", page, claim, float(np.median(ratio)), protocol, verdict)


def _dynamic(errors: pd.DataFrame, group: str, claim: str) -> Row:
    own = per_run(errors[errors["group"] == group])
    rmse = {str(model): runs["rmse"].to_numpy() for model, runs in own.groupby("model")}
    pair = (rmse["physics"], rmse["black_box"])
    verdict = order_verdict(*(pair if group == "explored" else pair[::-1]), paired=True)
    ratio = float(np.median(rmse["black_box"] / rmse["physics"]))
    page, protocol = "section 2.6.1, figs. 2.16 and 2.17", DYNAMIC.format(n=len(pair[0]))
    return _row(f"dynamic_{group}", page, claim, ratio, protocol, verdict)
