"""Compute the examples of chapter 2, the tutorial, with physics, networks and both together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pipeline.cam_follower.static import efficiency, fit_motor, fit_network
from pipeline.chapters import chapter2
from pipeline.chapters.claims import complete
from pipeline.chapters.readable import equations_of, write_chapter, write_metrics
from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.base.files import read_json
from unmodelled.base.ownership import verb
from unmodelled.base.progress import track
from unmodelled.learning.augmented import AugmentedRecipe
from unmodelled.learning.held_out import free_runs
from unmodelled.learning.splits import Fold
from unmodelled.learning.structures import Structure
from unmodelled.learning.windows import Training
from unmodelled.logs.folder import read_logs
from unmodelled.logs.logs import Logs
from unmodelled.logs.table import read_columns
from unmodelled.systems.model import System
from unmodelled.systems.reader import read_system

Tables = dict[str, pd.DataFrame]


@verb()
def teach(
    raw: Path,
    system: Path,
    models: Mapping[str, Structure],
    windows: Training,
    trained: int,
    repeats: int,
    hidden: Sequence[int],
    penalty: float,
    seeds: int,
    seed: int,
    out: Path,
    reports: Path,
) -> None:
    """Write tables, claims and equations to `out`, and metrics/chapter2.json to `reports`.

    Args:
        raw: folder written by acquire with source=tutorial.
        system: system file of the pendulum's known physics.
        models: structures of the pendulum's models by name: physics, black_box and any others.
        windows: settings of the training of these models.
        trained: number of training runs from the group explored; the other runs are held out.
        repeats: number of trainings per model, from different initial weights.
        hidden: numbers of neurons of the networks for the motor's efficiency; the figures show the last one
            beside the physics.
        penalty: weight lambda of eq. 2.6.
        seeds: number of networks per number of neurons, with and without the penalty.
        seed: seed of the initial weights and mini-batches of the pendulum's models.
        out: folder that is new, empty or was made by this verb; replaced as a whole.
        reports: folder whose metrics/chapter2.json is rewritten.

    Raises:
        BadInput: when an input is missing, or there is no run to train on or to hold out.
    """
    bench, kind = read_json(raw / "bench.json"), str(read_json(raw / "provenance.json")["data"])
    about = {name: bench[name] for name in ("lowest", "highest", "noise")}
    about |= {"voltage": bench["motor"]["voltage"], "penalty": penalty}
    motor = _motor(raw, about, hidden, seeds)
    known = read_system(system)
    logs = read_logs(raw / "pendulum", known)
    recipes = {name: AugmentedRecipe(m, windows, method="rk4", hold=1.0) for name, m in models.items()}
    swings = _pendulum(known, logs, recipes, trained, repeats, seed)
    static = chapter2.curve_errors(_curves(motor, hidden[-1], penalty), about["lowest"], about["highest"])
    dynamic = swings["swing_errors"]
    claims = complete(chapter2.claims(static, dynamic), kind)
    write_chapter(out, {**motor, **swings}, about=about, claims=claims, equations=equations_of(2, known))
    found = chapter2.numbers(about, static, motor["network_errors"], dynamic)
    write_metrics(reports, "chapter2", kind, "-", found)


def _motor(raw: Path, about: dict[str, Any], hidden: Sequence[int], seeds: int) -> Tables:
    """Tables training, new, truth, physics, networks, network_errors; the parameters go into `about`."""
    names = ("current", "efficiency")
    files = {n: read_columns(raw / f"{n}.csv", names).values for n in ("training", "new", "truth")}
    (u, y), (new_u, new_y), (grid, _) = ([table[name] for name in names] for table in files.values())
    about["resistance"], about["friction"] = fit_motor(u, y, about["voltage"])
    physics = efficiency(grid, about["voltage"], about["resistance"], about["friction"])
    curves, errors = [], []
    every = list(product((0.0, about["penalty"]), hidden, range(seeds)))
    for penalty, size, seed in track(every, len(every), "networks of the motor"):
        network = fit_network(u, y, size, penalty, seed)
        head = {"hidden": size, "penalty": penalty, "seed": seed}
        curves.append(pd.DataFrame({**head, "current": grid, "efficiency": network(grid)}))
        errors.append({**head, "training": _rms(network(u) - y), "new": _rms(network(new_u) - new_y)})
    return {
        **{name: pd.DataFrame(table) for name, table in files.items()},
        "physics": pd.DataFrame({"current": grid, "efficiency": physics}),
        "networks": pd.concat(curves, ignore_index=True),
        "network_errors": pd.DataFrame(errors),
    }


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _curves(motor: Tables, hidden: int, penalty: float) -> pd.DataFrame:
    """Return the predictions and the truth: columns model, seed, current, efficiency, truth."""
    networks = motor["networks"]
    shown = networks[(networks["hidden"] == hidden) & (networks["penalty"] == penalty)]
    both = [motor["physics"].assign(model="physics", seed=0), shown.assign(model="network")]
    truth = motor["truth"].rename(columns={"efficiency": "truth"})
    return pd.concat(both, ignore_index=True).merge(truth, on="current")


def _pendulum(
    known: System, logs: Logs, recipes: Mapping[str, AugmentedRecipe], trained: int, repeats: int, seed: int
) -> Tables:
    """Tables region (what models may see), swing_errors and forecasts."""
    explored = np.flatnonzero(logs.experiments["group"] == "explored")
    unseen = np.flatnonzero(logs.experiments["group"] == "unseen")
    if not 0 < trained < len(explored):
        raise BadInput(f"trained: must be 1 to {len(explored) - 1}, got {trained}")
    test = np.concatenate([explored[trained:], unseen])
    folds = [Fold(f"repeat {k + 1}", explored[:trained], test) for k in range(repeats)]
    errors, forecasts = [], []
    for name, recipe in recipes.items():
        fit = recipe.fit(known, logs, folds, seed=seed)
        runs = free_runs(fit.model, logs, {fold.name: fold.test for fold in folds}, 1, fit.integration)
        errors.append(runs.errors[runs.errors["state"] == "theta"].assign(model=name))
        forecasts.append(runs.examples.assign(model=name))
    region = chapter2.Region(logs.x[np.isin(logs.owner, explored[:trained])])
    shown = pd.concat(forecasts, ignore_index=True)
    shown["explored"] = region.holds(shown[[f"{name}_measured" for name in logs.states]].to_numpy())
    tables = {"swing_errors": pd.concat(errors, ignore_index=True), "forecasts": shown}
    group = dict(zip(logs.ids, logs.experiments["group"], strict=True))
    outline = pd.DataFrame(region.outline, columns=list(logs.states))
    return {"region": outline, **{n: t.assign(group=t["id"].map(group)) for n, t in tables.items()}}
