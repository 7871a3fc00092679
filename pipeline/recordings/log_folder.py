"""Recordings of measured experiments, each on its own clock, and their log folders."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.interpolate import CubicSpline

from unmodelled.base.errors import BadInput
from unmodelled.base.parquet import write_parquet
from unmodelled.logs.clock import LONGEST_GAP

#: Samples on a new clock for every logged one; more of them would say nothing new.
MOST = 10


@dataclass(frozen=True)
class Experiment:
    """One row of experiments.csv and its log."""

    id: str
    samples: pd.DataFrame  # columns t (s, from any start), inputs and outputs
    #: Operating point, and `group` if some belong together
    constants: Mapping[str, float | str] = field(default_factory=dict)


class Recording(ABC):
    """Published measurements that become a log folder."""

    @property
    @abstractmethod
    def about(self) -> Mapping[str, str]:
        """Provenance of the measurements: description, url, and licence if there is one."""

    @abstractmethod
    def experiments(self) -> list[Experiment]:
        """Read the experiments.

        Raises:
            BadInput: when a file is missing or damaged, or lacks something that the experiments consist of.
        """

    def write(self, folder: Path, seed: int) -> dict[str, Any]:
        """Write a log folder, and return the provenance.

        Args:
            folder: existing folder that is written into.
            seed: unused, because nothing is random.

        Raises:
            BadInput: when the measurements cannot be read.
        """
        found = self.experiments()
        write_log_folder(folder, found)
        return {"data": "measured", **self.about, "experiments": len(found)}


def write_log_folder(folder: Path, experiments: Sequence[Experiment]) -> None:
    """Write a log folder; every log starts at t = 0."""
    ids = [one.id for one in experiments]
    if twice := [name for name in ids if ids.count(name) > 1]:
        raise BadInput(f"source.archive: two recordings are called {twice[0]}; keep one of them")
    for one in experiments:
        t = one.samples["t"]
        write_parquet(one.samples.assign(t=t - t.iloc[0]), folder / f"{one.id}.parquet")
    rows = [{"id": one.id, "file": f"{one.id}.parquet", **one.constants} for one in experiments]
    pd.DataFrame(rows).to_csv(folder / "experiments.csv", index=False, lineterminator="\n")


def parts(recording: pd.DataFrame, count: int, where: str) -> list[pd.DataFrame]:
    """Divide a recording into equally long parts; remaining samples at its end are dropped."""
    if isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= len(recording):
        most = f"{len(recording)}, the samples of {where}"
        raise BadInput(f"source.parts: must be a whole number from 1 to {most}, got {count!r}")
    length = len(recording) // count
    return [recording.iloc[k * length : (k + 1) * length] for k in range(count)]


def on_clock(recording: pd.DataFrame, period: float, held: Sequence[str], where: str) -> pd.DataFrame:
    """Resample a recording of several sampling rates on a uniform clock of `period` s."""
    t = recording["t"].to_numpy()
    steps = np.diff(t)
    if len(back := np.flatnonzero(~(steps > 0.0))):
        k = int(back[0]) + 1
        raise BadInput(
            f"{where}: sample {k + 1}: time must increase, {t[k]:.10g} s follows {t[k - 1]:.10g} s"
        )
    if len(steps) and steps.max() > LONGEST_GAP * (middle := float(np.median(steps))):
        k = int(np.argmax(steps)) + 1
        raise BadInput(
            f"{where}: sample {k + 1}: gap of {steps[k - 1]:.4g} s, more than {LONGEST_GAP:g} sampling "
            f"periods of {middle:.4g} s"
        )
    if not isinstance(period, int | float) or not MOST * len(t) * period > t[-1] - t[0]:
        raise BadInput(
            f"source.period: must be a number of s, no less than a tenth of the logged period, got {period!r}"
        )
    clock = t[0] + period * np.arange(int((t[-1] - t[0]) / period * (1.0 + 1e-12)) + 1)
    clock = np.minimum(clock, t[-1])
    read = {
        name: np.interp(clock, t, values) if name in held else CubicSpline(t, values)(clock)
        for name, values in recording.drop(columns="t").items()
    }
    return pd.DataFrame({"t": clock, **read})
