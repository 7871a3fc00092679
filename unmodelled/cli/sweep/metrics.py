"""Read the metrics of a run from the files that its verb has written."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pandas as pd

from unmodelled.base.errors import BadInput
from unmodelled.base.files import read_json

#: The first of these that a sweep has is what it is compared by.
PREFERRED = (
    "diagnosis.gap.augmented",
    "errors.omega_mse",
    "errors.omega.rmse",
    "errors.rmse",
    "repeats.mse",
    "tuning.omega_mse",
    "simulation.gap.known",
    "history.loss",
)


def metrics_of(folder: Path) -> dict[str, float]:
    """Return the metrics of a run by name, `<file>.<what>`; none if the folder holds no results.

    Tables that assess models give the median over test runs and repeats, in the unit of the table. JSON files
    give every number outside lists.
    """
    found: dict[str, float] = {}
    for name, measure in _TABLES.items():
        path = folder / f"{name}.parquet"
        if path.exists():
            found |= {f"{name}.{what}": value for what, value in _measured(path, measure)}
    for path in sorted(folder.glob("*.json")):
        found |= {f"{path.stem}.{what}": value for what, value in _leaves(read_json(path), "")}
    return found


Measures = Iterator[tuple[str, float]]


def _measured(path: Path, measure: Callable[[pd.DataFrame], Measures]) -> list[tuple[str, float]]:
    from unmodelled.base.parquet import read_parquet  # with pyarrow, which the trainings need

    try:
        return [(name, float(value)) for name, value in measure(read_parquet(path))]
    except KeyError as error:
        raise BadInput(f"{path}: has no column {error}") from None


def _leaves(node: Any, path: str) -> Measures:
    if isinstance(node, dict):
        for key, inner in node.items():
            yield from _leaves(inner, f"{path}.{key}" if path else key)
    elif isinstance(node, int | float) and not isinstance(node, bool):
        yield path, node


def _errors(table: pd.DataFrame) -> Measures:
    """Yield the median error of held-out free runs (of every state), and the share of diverged runs."""
    for prefix, rows in _parts(table, "state"):
        for column in ("rmse", "omega_mse", "omega_mse_time"):
            if column in rows:
                yield f"{prefix}{column}", rows[column].median()
        if "diverged" in rows:
            yield f"{prefix}diverged", rows["diverged"].mean()


def _repeats(table: pd.DataFrame) -> Measures:
    """Yield the median error of predicted detachment, and the share of runs with the right label."""
    for prefix, rows in _parts(table, "model"):
        yield f"{prefix}mse", rows["mse"].median()
        yield f"{prefix}accuracy", (rows["jumps"] == (rows["label"] == "jump")).mean()


def _tuning(table: pd.DataFrame) -> Measures:
    """Yield the median error of the best number of hidden units."""
    yield "omega_mse", table.groupby("hidden")["omega_mse"].median().min()


def _history(table: pd.DataFrame) -> Measures:
    """Yield the median of the last losses of a training over all folds and repeats."""
    yield "loss", table.sort_values("epoch").groupby(["fold", "repeat"])["loss"].last().median()


def _parts(table: pd.DataFrame, column: str) -> Iterator[tuple[str, pd.DataFrame]]:
    """The rows of every value of `column` with its name in front, or all of them if there is only one."""
    if column not in table or table[column].nunique() == 1:
        yield "", table
    else:
        for value, rows in table.groupby(column, sort=False):
            yield f"{value}.", rows


_TABLES: dict[str, Callable[[pd.DataFrame], Measures]] = {
    "errors": _errors,
    "repeats": _repeats,
    "tuning": _tuning,
    "history": _history,
}
