"""Predict the held-out experiments with fitted models."""

from __future__ import annotations

from pathlib import Path

from unmodelled.base.files import replacing_folder
from unmodelled.base.ownership import verb
from unmodelled.base.parquet import write_parquet
from unmodelled.learning.recipe import Recipe
from unmodelled.learning.splits import Split


@verb()
def evaluate(
    system: Path | None, logs: Path | None, model: Recipe, split: Split, fits: Path, out: Path
) -> None:
    """Write one table per kind of prediction: held-out experiments, simulated from their first state.

    A hybrid model of a system writes `out`/errors.parquet and examples.parquet (free runs), efforts.parquet
    (efforts of the networks on the training experiments) and surface.parquet (networks of two inputs on a
    grid). The docstring of a model of another kind describes its tables.

    Args:
        system: system file.
        logs: log folder, or the store that ingest made of one.
        model: model that was fitted.
        split: division of the experiments into folds.
        fits: folder written by train for the same model and split.
        out: folder that is new, empty or was made by this verb; replaced as a whole.

    Raises:
        BadInput: when an input is missing or the fit belongs to another model or split.
    """
    tables = model.evaluate(system, logs, fits, split)
    with replacing_folder(out) as folder:
        for name, table in tables.items():
            write_parquet(table, folder / f"{name}.parquet")
