"""Compute the contribution of each input of a network to its predicted follower jumps."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pipeline.attribution import tables
from pipeline.attribution.deep_shap import deep_shap
from pipeline.cam_follower.detachment import Family
from pipeline.cam_follower.jumps import example_rows
from pipeline.cam_follower.lstm import DetachmentNetwork
from pipeline.cam_follower.sequences import Sequences
from pipeline.splits import fold_named
from unmodelled.base.arrays import Indices
from unmodelled.base.campaign import Campaign
from unmodelled.base.errors import BadInput
from unmodelled.base.files import replacing_folder, write_json
from unmodelled.base.ownership import verb
from unmodelled.base.parquet import write_parquet
from unmodelled.base.progress import track
from unmodelled.learning.splits import Split

Tables = dict[str, pd.DataFrame]

#: Steps from one point to the next in the table of points: a tenth of all, 0.1 s apart.
EVERY = 10


@verb()
def attribute(
    fits: Path,
    model: Family,
    explained: list[str],
    split: Split,
    fold: str,
    groups: Mapping[str, list[str]],
    profile: Mapping[str, Any],
    seed: int,
    out: Path,
) -> None:
    """Write DeepSHAP attributions of jump test runs, against contact training runs, to `out` (section 5.5).

    Every table has a column `model`. Of all repeats, with a column `repeat`:

    - shares: exp, feature, magnitude (sum of |Phi| over the steps, m), share (of the run);
    - overall: feature, share (of all runs);
    - accuracy: exp, steps, error (the largest of eq. 5.17, m), relative.

    Of the first repeat:

    - phi: exp, step, feature, phi (m), and explained: exp, step, base, output (m), of the example runs;
    - points: exp, step, feature, phi (m), value (of the input, in SI units) and base (m), of every tenth step
      of all explained runs; `pipeline.figures.jumps.contributions` makes a `shap.Explanation` of them;
    - exact: exp, feature, magnitude, share, method (deep_shap or exact), and agreement: exp and the rank
      correlations shares and trajectories, on a few runs and references.

    attribution.json holds the numbers of runs and references, and the duration.

    Args:
        fits: folder written by train for the same model and split.
        model: models of the follower's detachment that were fitted.
        explained: names of the models to explain.
        split: division of the runs into folds.
        fold: name of the fold whose networks are explained.
        groups: names of the inputs of every player of the exact values; other inputs are players of their
            own.
        profile: numbers of runs: `explained_runs` and `references` of DeepSHAP, `exact_runs` and
            `exact_references` of the exact values.
        seed: seed of the choice of runs and references.
        out: folder that is new, empty or was made by this verb; replaced as a whole.

    Raises:
        BadInput: when an input is missing, the fits belong to another model, or there is nothing to explain.
    """
    begin = time.monotonic()
    campaign = Campaign.read(model.features)
    rows = fold_named(split.folds(campaign.experiments), fold)
    chosen = tables.Choice.of(campaign.experiments, rows.train, rows.test, profile, seed)
    shown = np.array(example_rows(campaign.experiments, rows.test)["jump"])
    members = {name: _networks(model, name, fits, fold) for name in explained}
    total = sum(map(len, members.values()))
    with replacing_folder(out) as folder:
        parts: list[Tables] = []
        work = ((name, k, network) for name, found in members.items() for k, network in enumerate(found))
        for name, k, network in track(work, total, f"explaining {total} networks"):
            sequences = Sequences.of(campaign, network.inputs, model.members[name].samples)
            own = _shares(network, sequences, chosen, k)
            own |= _closer(network, sequences, chosen, shown, groups) if k == 0 else {}
            parts.append({kind: table.assign(model=name) for kind, table in own.items()})
        _write(folder, parts)
        counts = {"runs": len(chosen.runs), "references": len(chosen.references), "fold": fold}
        write_json(folder / "attribution.json", {**counts, "seconds": time.monotonic() - begin})


def _write(folder: Path, parts: Sequence[Tables]) -> None:
    """Write every kind of table as one file, with the rows of all parts."""
    for kind in parts[0]:
        table = pd.concat([part[kind] for part in parts if kind in part], ignore_index=True)
        write_parquet(table, folder / f"{kind}.parquet")


def _networks(model: Family, name: str, fits: Path, fold: str) -> Sequence[DetachmentNetwork]:
    if name not in model.members:
        raise BadInput(f"explained: unknown {name}, must be one of {', '.join(model.members)}")
    found = model.members[name].read(fits / name)
    if not found.explainable:
        raise BadInput(f"explained: {name} is no network of the measured signals alone")
    if fold not in found.explainable:
        raise BadInput(f"{fits / name}: was fitted on the folds {', '.join(found.folds)}, not on {fold}")
    return found.explainable[fold]


def _shares(network: DetachmentNetwork, sequences: Sequences, chosen: tables.Choice, repeat: int) -> Tables:
    runs = sequences.of_runs(chosen.runs)
    found = deep_shap(network, runs, sequences.of_runs(chosen.references))
    made = {
        "shares": tables.run_shares(found),
        "overall": tables.overall_shares(found),
        "accuracy": tables.accuracies(found),
    }
    made |= {"points": tables.points(found, runs, EVERY)} if repeat == 0 else {}
    return {kind: table.assign(repeat=repeat) for kind, table in made.items()}


def _closer(
    network: DetachmentNetwork,
    sequences: Sequences,
    chosen: tables.Choice,
    shown: Indices,
    groups: Mapping[str, list[str]],
) -> Tables:
    found = deep_shap(network, sequences.of_runs(shown), sequences.of_runs(chosen.references))
    phi, explained = tables.trajectories(found)
    few = sequences.of_runs(chosen.exact_runs), sequences.of_runs(chosen.exact_references)
    exact, agreement = tables.against_exact(network, *few, groups)
    return {"phi": phi, "explained": explained, "exact": exact, "agreement": agreement}
