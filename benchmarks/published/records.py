"""Public data sets with their official splits.

Splits and first samples that do not count are those of the package nonlinear_benchmarks 1.0.1 (G. Beintema,
nonlinearbenchmark.org).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from pipeline.recordings import cascaded_tanks, emps, silverbox
from pipeline.recordings.archive import Archive
from pipeline.recordings.log_folder import parts
from unmodelled.base.arrays import Array

SYSTEMS = Path(__file__).parents[2] / "systems"
#: Silverbox: rows of the training record and of the three test records.
TRAINED = slice(40_650, 105_712)
TESTED = {
    "multisine": slice(105_712, 127_400),
    "arrow, full": slice(100, 40_575),
    "arrow, no extrapolation": slice(100, 32_100),
}


@dataclass(frozen=True)
class Records:
    """A public data set with its official split."""

    #: Experiments, cut from the training record, by id.
    training: Mapping[str, pd.DataFrame]
    tests: Mapping[str, pd.DataFrame]
    #: Columns of the input and of the output.
    u: str
    y: str
    #: First samples of a test record that set the start state and do not count.
    seen: int
    #: Unit of the published errors, and its size in units of the output.
    unit: str
    factor: float
    #: System files below `SYSTEMS`.
    systems: tuple[str, ...]

    def rmse(self, test: str, simulated: Array) -> float:
        """Return the root mean square error of a test in `unit`; simulated has shape (samples,)."""
        off = simulated - self.tests[test][self.y].to_numpy()
        return float(np.sqrt(np.mean(off[self.seen :] ** 2))) / self.factor


def read_silverbox(archive: str) -> Records:
    """Read the multisine and the arrow: realisations that the training record has, whole or in part."""
    source = Archive(archive, "SILVERBOX")
    record = source.table(source.names(silverbox.FILE)[0], ["V1", "V2"])
    record.insert(0, "t", silverbox.PERIOD * np.arange(len(record)))
    starts = silverbox.FIRST + silverbox.STEP * np.arange(silverbox.REALISATIONS)
    begun = [int(start) for start in starts if start < TRAINED.stop]
    ends = [min(start + silverbox.LENGTH, TRAINED.stop) for start in begun]
    rows = [slice(max(a, TRAINED.start), b) for a, b in zip(begun, ends, strict=True)]
    training = {f"multisine_{k}": record.iloc[at] for k, at in enumerate(rows, start=1)}
    tests = {name: record.iloc[at] for name, at in TESTED.items()}
    return Records(training, tests, "V1", "V2", 50, "mV", 1e-3, ("silverbox/hardening_withheld.yaml",))


def read_cascaded_tanks(archive: str) -> Records:
    """Read the two records; the training record is cut in three, as docs/real does it."""
    source = Archive(archive, "CASCADED_TANKS")
    name = source.names(cascaded_tanks.FILE)[0]
    table = source.table(name, [column for record in cascaded_tanks.RECORDS.values() for column in record])
    t = cascaded_tanks.PERIOD * np.arange(len(table))
    frames = {
        record: pd.DataFrame({"t": t, "u": table[u], "y": table[y]})
        for record, (u, y) in cascaded_tanks.RECORDS.items()
    }
    training = _cut(frames["est"], 3, name)
    systems = ("cascaded_tanks/overflow_withheld.yaml",)
    return Records(training, {"val": frames["val"]}, "u", "y", 50, "V", 1.0, systems)


def read_emps(folder: str) -> Records:
    """Read the recording without pulses, cut in five as docs/real does it, and the one with pulses."""
    plain, pulses = (emps.read(Path(folder).expanduser() / file) for file in emps.FILES.values())
    systems = ("emps/coulomb_withheld.yaml", "emps/nothing_withheld.yaml")
    return Records(_cut(plain, 5, "DATA_EMPS"), {"pulses": pulses}, "vir", "qm", 20, "mm", 1e-3, systems)


SETS: dict[str, Callable[[str], Records]] = {
    "silverbox": read_silverbox,
    "cascaded_tanks": read_cascaded_tanks,
    "emps": read_emps,
}


def _cut(record: pd.DataFrame, count: int, where: str) -> dict[str, pd.DataFrame]:
    return {f"part_{k}": part for k, part in enumerate(parts(record, count, where), start=1)}
