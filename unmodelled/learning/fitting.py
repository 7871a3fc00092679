"""Fit one hybrid model of a system per fold and repeat, and keep what later stages want to know."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from unmodelled.base.errors import BadInput
from unmodelled.base.files import replacing, write_json
from unmodelled.base.parquet import write_parquet
from unmodelled.base.progress import Counter
from unmodelled.learning.augmented import AugmentedRecipe, start_from
from unmodelled.learning.checkpoint import read_checkpoint, restore, save
from unmodelled.learning.resume import identity, load_progress, save_progress
from unmodelled.learning.windows import Problem, Progress, finished
from unmodelled.logs.logs import Logs
from unmodelled.models.nnap import Nnap
from unmodelled.models.rollout import Measured
from unmodelled.systems.model import System

#: A checkpoint is written about this often, s.
INTERVAL = 10.0


@dataclass(frozen=True)
class Members:
    """The models of a stack.

    Attributes:
        folds: names, folds slowest. repeats: models per fold. runs: training experiments of every model.
    """

    folds: tuple[str, ...]
    repeats: int
    runs: list[np.ndarray[tuple[int, ...], np.dtype[np.int64]]]

    @classmethod
    def of(cls, names: Sequence[str], train: Sequence[Any], repeats: int) -> Members:
        """`repeats` models for every fold."""
        return cls(tuple(names), repeats, [np.asarray(t, np.int64) for t in train for _ in range(repeats)])

    def labels(self) -> list[tuple[str, int]]:
        """(fold, repeat) of every model."""
        return [(fold, r) for fold in self.folds for r in range(self.repeats)]


def fit(
    recipe: AugmentedRecipe,
    system: System,
    logs: Logs,
    members: Members,
    seed: int,
    start: Path | None,
    device: str,
    out: Path,
) -> None:
    """Write `out`/model.pt, fit.json and history.parquet (fold, repeat, epoch, loss, parameter columns,
    seconds).

    A training that was killed goes on where its last checkpoint, a hidden file beside `out`, was written. A
    model whose loss is not finite keeps the weights before that and is reported; the others go on.

    Raises:
        BadInput: when the recipe does not fit the system, the data or the fit to start from.
    """
    problem = recipe.problem(system, Measured.of(logs), logs.period, members.runs, seed)
    if start is not None:
        start_from(problem, load_fit(recipe, system, start)[0])
    name, checkpoint = identity(problem, recipe.windows), out.with_name(f".{out.name}.checkpoint")
    stack = load_progress(checkpoint, name)
    if stack is None:
        stack = [Progress.start(problem.model, m) for m in range(len(members.runs))]
    begin = time.monotonic()
    if device == "cpu":
        _train(recipe, problem, stack, checkpoint, name)
    else:
        from unmodelled.learning.on_device import train_on

        train_on(device, problem, recipe.windows, stack)
    diverged = [label for label, s in zip(members.labels(), stack, strict=True) if s.diverged]
    for fold, repeat in diverged:
        print(
            f"warning: fold {fold}, repeat {repeat}: diverged, its last finite weights are kept",
            file=sys.stderr,
        )
    about = {"folds": list(members.folds), "repeats": members.repeats, "seed": seed}
    save(finished(problem.model, stack), out / "model.pt", about)
    with replacing(out / "history.parquet") as temporary:
        write_parquet(_history(problem, members, stack), temporary)
    structure = problem.model.structure
    facts = {
        "parameters": structure.size + len(structure.trainable),
        "identified": list(structure.trainable),
        "horizon": recipe.windows.horizon,
        "epochs": recipe.windows.epochs,
        "diverged": [[fold, repeat] for fold, repeat in diverged],
        "seconds": time.monotonic() - begin,
    }
    write_json(out / "fit.json", {**about, **facts})
    checkpoint.unlink(missing_ok=True)
    _tell(problem, stack)


def _tell(problem: Problem, stack: list[Progress]) -> None:
    """The parameters that were identified, for a human: median and range over the stack."""
    structure = problem.model.structure
    units = {p.name: p.unit for p in structure.system.parameters}
    for k, name in enumerate(structure.trainable):
        low, middle, high = np.quantile([s.p[structure.index[k]] for s in stack], [0.0, 0.5, 1.0])
        print(f"{name}: {middle:.4g} {units[name]}, from {low:.4g} to {high:.4g} over {len(stack)} models")


def _train(
    recipe: AugmentedRecipe, problem: Problem, stack: list[Progress], checkpoint: Path, name: str
) -> None:
    total = recipe.windows.epochs * len(stack)
    last = time.monotonic()
    with Counter(total, f"training {len(stack)} models, epochs") as counter:
        for done in recipe.windows.train(problem, stack):
            counter.update(done)
            if time.monotonic() - last > INTERVAL:
                save_progress(checkpoint, stack, name)
                last = time.monotonic()


def _history(problem: Problem, members: Members, stack: list[Progress]) -> pd.DataFrame:
    names = problem.model.structure.trainable
    tables = []
    for (fold, repeat), s in zip(members.labels(), stack, strict=True):
        values = np.array(s.history).reshape(len(s.losses), len(names))
        table = pd.DataFrame({"fold": fold, "repeat": repeat, "epoch": np.arange(1, len(s.losses) + 1)})
        columns = {name: values[:, k] for k, name in enumerate(names)}
        tables.append(table.assign(loss=s.losses, seconds=s.seconds, **columns))
    return pd.concat(tables, ignore_index=True)


def load_fit(recipe: AugmentedRecipe, system: System, fits: Path) -> tuple[Nnap, dict[str, Any]]:
    """The fitted stack in the folder `fits`, and the facts about it.

    Raises:
        BadInput: when it is missing, damaged, or belongs to another model.
    """
    path = fits / "model.pt"
    content = read_checkpoint(path)
    parts = ("p", "unit", "scale", "gain", "weights")
    try:
        model = Nnap(recipe.plan(system).structure, *(content["state"][name] for name in parts))
    except (KeyError, TypeError, AttributeError, IndexError, RuntimeError):
        raise BadInput(
            f"{path}: is a checkpoint of {content['class']}, not of the configured model"
        ) from None
    restore(model, content, path)
    _check_shapes(model, path)
    return model, content["about"]


def _check_shapes(model: Nnap, path: Path) -> None:
    structure, batch = model.structure, model.batch
    wanted = {
        "p": (batch, len(structure.system.parameters)),
        "unit": (len(structure.trainable),),
        "scale": (batch, len(structure.inputs)),
        "gain": (batch, len(structure.networks)),
        "weights": (batch, structure.size),
    }
    for name, shape in wanted.items():
        found = tuple(getattr(model, name).shape)
        if found != shape:
            raise BadInput(f"{path}: does not fit the configured model ({name} must be {shape}, got {found})")
