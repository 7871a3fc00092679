"""Experiments as a caller has them in memory: one data frame, several, or their columns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
import pandas as pd

from unmodelled.base.errors import BadInput

#: Column of one frame of many experiments that names the experiment of a row, as in `Logs.table`.
EXPERIMENT = "experiment"
#: One data frame, several, or several by their ids; columns by name stand for a frame.
FramesGiven: TypeAlias = pd.DataFrame | Sequence[Any] | Mapping[str, Any]


def frames_of(given: Any) -> Mapping[str, pd.DataFrame]:
    """Return data frames by the ids of their experiments.

    Examples:
        >>> list(frames_of([{"t": [0.0, 0.1], "u": [1.0, 2.0]}])["run1"].columns)
        ['t', 'u']
    """
    if isinstance(given, pd.DataFrame):
        if EXPERIMENT in given.columns:
            return {str(name): frame for name, frame in given.groupby(EXPERIMENT, sort=False)}
        given = [given]
    named: Any = given
    if isinstance(given, Sequence) and not isinstance(given, str | bytes):
        named = {f"run{k + 1}": frame for k, frame in enumerate(given)}
    elif isinstance(given, Mapping) and "t" in given and not isinstance(given["t"], pd.DataFrame):
        named = {"run1": given}
    if not isinstance(named, Mapping):
        wanted = "logs, the path of their folder, a data frame, or data frames in a list or by their ids"
        raise BadInput(f"logs: must be {wanted}, got {type(given).__name__}")
    return {str(name): _frame(str(name), frame) for name, frame in named.items()}


def _frame(name: str, given: Any) -> pd.DataFrame:
    """A data frame, or one of columns of equal length."""
    if isinstance(given, pd.DataFrame):
        return given
    if not isinstance(given, Mapping):
        raise BadInput(
            f"logs[{name!r}]: must be a data frame or a mapping of columns, got {type(given).__name__}"
        )
    columns = {str(key): np.asarray(column) for key, column in given.items()}
    for key, column in columns.items():
        if column.ndim != 1:
            raise BadInput(
                f"logs[{name!r}]: column {key}: must have one number per sample, got shape {column.shape}"
            )
    lengths = {key: len(column) for key, column in columns.items()}
    if len(set(lengths.values())) > 1:
        told = ", ".join(f"{key} has {length}" for key, length in lengths.items())
        raise BadInput(f"logs[{name!r}]: columns must be equally long: {told} samples")
    return pd.DataFrame(columns)
