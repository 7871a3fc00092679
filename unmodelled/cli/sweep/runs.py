"""Return the runs of a sweep as one table of keys and metrics."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd
import yaml
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.errors import HydraException

from unmodelled.base.errors import BadInput
from unmodelled.base.limits import OBJECTS, check_file
from unmodelled.base.markers import RECORD
from unmodelled.base.search import Search
from unmodelled.cli.sweep.metrics import metrics_of

#: The keys that a run of a sweep was given.
OVERRIDES = Path(RECORD) / "overrides.yaml"
#: What a run of a sweep that failed leaves: one line that says why.
FAILURE = Path(RECORD) / "error.txt"

Value = str | int | float | bool | None


@dataclass(frozen=True)
class Run:
    """One run of a sweep."""

    name: str  # path of its folder below that of the sweep
    keys: dict[str, Value]  # that changed its configuration, and that of the fit that it read (fits=<folder>)
    metrics: dict[str, float]  # see `unmodelled.cli.sweep.metrics`; not all finite
    failure: str  # why there are no metrics

    def has(self, metric: str) -> bool:
        """Tell whether the run has a metric as a finite number."""
        return math.isfinite(self.metrics.get(metric, math.nan))


def run_folders(folder: Path) -> list[Path]:
    """Find the folders of the runs of a sweep."""
    if not folder.is_dir():
        raise BadInput(f"{folder}: no such folder")
    search = Search(lambda why: BadInput(f"{folder}: {why}: give the folder of the sweep"))
    found = [path.parents[1] for path in search.below(folder) if path.parts[-2:] == OVERRIDES.parts]
    if not found:
        raise BadInput(f"{folder}: no runs of a sweep in it, that is no folder with {OVERRIDES}")
    return sorted(found, key=lambda path: [(len(p) if p.isdigit() else 0, p) for p in path.parts])


def read_run(folder: Path, sweep: Path) -> Run:
    """Read one run of a sweep."""
    metrics = metrics_of(folder)
    failure = ""
    if not metrics:
        told = folder / FAILURE
        check_file(told)
        failure = told.read_text(errors="replace").strip() if told.exists() else "nothing written"
    return Run(folder.relative_to(sweep).as_posix(), _keys(folder / OVERRIDES), metrics, failure)


def _keys(path: Path) -> dict[str, Value]:
    keys = _overrides(path)
    fit = Path(str(keys.get("fits"))) / OVERRIDES
    if fit.exists():
        del keys["fits"]
        keys = {**_overrides(fit), **keys}
    return keys


def _overrides(path: Path) -> dict[str, Value]:
    check_file(path, OBJECTS)
    try:
        lines = yaml.safe_load(path.read_text())
    except (OSError, ValueError, RecursionError, yaml.YAMLError) as error:
        raise BadInput(f"{path}: cannot be read: {' '.join(str(error).split())}") from None
    if not (isinstance(lines, list) and all(isinstance(line, str) for line in lines)):
        raise BadInput(f"{path}: must be a list of key=value")
    keys: dict[str, Value] = {}
    for number, line in enumerate(lines, start=1):
        try:
            override = OverridesParser.create().parse_override(line)
        except (HydraException, LookupError, ValueError):
            raise BadInput(f"{path}: item {number}: {line!r} is not key=value") from None
        value = override.value()
        if not (value is None or isinstance(value, str | int | float)):
            value = override.get_value_element_as_str()
        keys[override.key_or_group] = value
    return keys


def table_of(runs: Sequence[Run]) -> pd.DataFrame:
    """Return a table with one row per run: run, its keys, its metrics, failure; missing values are empty."""
    keys, metrics = _names([run.keys for run in runs]), _names([run.metrics for run in runs])
    columns = {"run": pd.Series([run.name for run in runs], dtype="str")}
    columns |= {key: _column([run.keys.get(key) for run in runs]) for key in keys}
    columns |= {name: pd.Series([run.metrics.get(name) for run in runs], dtype=float) for name in metrics}
    return pd.DataFrame({**columns, "failure": [run.failure or None for run in runs]})


def swept_keys(runs: Sequence[Run]) -> list[str]:
    """Return the keys whose values differ between the runs."""
    names = _names([run.keys for run in runs])
    return [name for name in names if len({str(run.keys.get(name)) for run in runs}) > 1]


def metric_names(runs: Sequence[Run]) -> list[str]:
    """Return the metrics that at least one run has as a finite number."""
    return [name for name in _names([run.metrics for run in runs]) if any(run.has(name) for run in runs)]


def _names(rows: Sequence[dict[str, Value]] | Sequence[dict[str, float]]) -> list[str]:
    return list(dict.fromkeys(name for row in rows for name in row))


def _column(values: list[Value]) -> pd.Series:
    """Numbers if all are numbers, else text: a column of a table has one type."""
    kinds = {type(value) for value in values if value is not None}
    if kinds <= {int, float}:
        return pd.Series(values, dtype="Float64" if float in kinds else "Int64")
    return pd.Series([None if value is None else str(value) for value in values], dtype="str")
