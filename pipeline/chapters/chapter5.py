"""Numbers of chapter 5: prediction of follower jumps, and contributions of the inputs."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from pipeline.arrays import Array
from pipeline.chapters.leaves import mean_leaf
from pipeline.chapters.summary import leaf, share

#: Where a single number stands for a model: the share of the runs of Fig. 5.15, 5.17 and 5.18.
SCARCE = "5%"
UNIFORM, FACTORS = "uniform", "factors"
#: The split of the models without q_s.
WITHOUT = "scarce"
BOUNCE, HYBRID = "bounce", "tau4_bounce"
PROTOCOL = {
    UNIFORM: "trained on a random share of the contact and jump runs, tested on all others",
    "split": "trained on the 1st, 3rd, ... of the sorted levels of a factor, tested on the others; the text "
    "does not say which were left out",
    "baseline": f"bounce: physics alone, its parameters from the training runs, {SCARCE} of the runs where "
    "no other fold is named; F-dagger: a jump where its minimum at 2 kHz is negative, nothing fitted, on the "
    "same test runs",
    "hybrid": f"the network on top of the bounce simulator; {SCARCE} of the runs where no other fold is "
    "named",
    "attribution": "networks trained on 30% of the runs; DeepSHAP of jump runs that were not trained on, "
    "against contact runs that were; shares of the sum of |Phi| over steps and runs, mean and interval over "
    "repeats",
}
COMMON = (
    "100 Hz, first 2 s of a run; median prediction of the repeats; MSE per run, median over the jump runs "
    "(mse_jump) or all runs (mse_all) that were tested, interval by bootstrap over them; a run counts as a "
    "jump where the mean over revolutions of the largest predicted detachment, as a share of the stroke, "
    "exceeds a level, by logistic regression on the training runs; accuracy with its Wilson interval; "
    "stalls left out"
)


def splits(trained: pd.Series[str], folds: pd.Series[str]) -> Array:
    """Return the experiment of the dissertation for every row: uniform, factors, or scarce for models without
    q_s.

    Gives (rows,).
    """
    experiment = np.where(folds.str.endswith("%"), UNIFORM, FACTORS)
    return np.where(trained == WITHOUT, WITHOUT, experiment)


def scores(runs: pd.DataFrame) -> dict[str, Any]:
    """Return mse_jump, mse_all and accuracy of one model on one fold."""
    jump = runs["label"] == "jump"
    found = {"mse_all": leaf(runs["mse"].to_numpy(), "mm^2")}
    found["accuracy"] = share(int((jump == runs["jumps"]).sum()), len(runs))
    # a tiny campaign may have no jump to test on
    return found | ({"mse_jump": leaf(runs.loc[jump, "mse"].to_numpy(), "mm^2")} if jump.any() else {})


def predictions(runs: pd.DataFrame) -> dict[str, Any]:
    """Return the numbers of the predictions: uniform, split, baseline.bounce and hybrid."""
    result: dict[str, Any] = {UNIFORM: {}, "split": {}, "baseline": {BOUNCE: {}}, "hybrid": {}}
    places = {BOUNCE: result["baseline"][BOUNCE], HYBRID: result["hybrid"]}
    for (split, fold, model), group in runs.groupby(["split", "fold", "model"]):
        section, level = ("split", fold) if split == FACTORS else (UNIFORM, fold.removesuffix("%"))
        found = scores(group)
        if model in places:
            places[model].setdefault(section, {})[level] = found
            if fold == SCARCE:
                places[model].update(found)
        else:
            result[section].setdefault(level, {})[model] = found
    for section, content in result.items():
        content["protocol"] = f"{PROTOCOL[section]}; {COMMON}"
    return result


def force_accuracy(runs: pd.DataFrame) -> dict[str, Any]:
    """Return the accuracy of F-dagger as a classifier of runs: a negative minimum is called a jump."""
    return share(int(((runs["f_min"] < 0.0) == (runs["label"] == "jump")).sum()), len(runs))


def attribution(tables: dict[str, pd.DataFrame]) -> dict[str, Any]:
    """Return the numbers of section 5.5."""
    accuracy = tables["accuracy"]
    worst = {"value": 1e3 * float(accuracy["error"].max()), "unit": "mm", "n": int(accuracy["steps"].sum())}
    shares = {
        str(model): {
            str(feature): mean_leaf(rows["share"].to_numpy(), "-")
            for feature, rows in group.groupby("feature", sort=False)
        }
        for model, group in tables["overall"].groupby("model")
    }
    agreement = {
        str(model): {kind: mean_leaf(group[kind].to_numpy(), "-") for kind in ("shares", "trajectories")}
        for model, group in tables["agreement"].groupby("model")
    }
    return {
        "local_accuracy_max": worst,
        "share": shares,
        "rank_correlation": agreement,
        "protocol": PROTOCOL["attribution"],
    }


def readable(runs: pd.DataFrame) -> pd.DataFrame:
    """Return one row per split, fold and model: the scores with their intervals."""
    rows = []
    for (split, fold, model), group in runs.groupby(["split", "fold", "model"], sort=False):
        row = {"split": split, "fold": fold, "model": model}
        for name, content in scores(group).items():
            low, high = content.get("interval", (None, None))
            row |= {name: content["value"], f"{name} low": low, f"{name} high": high}
        rows.append(row)
    return pd.DataFrame(rows)
