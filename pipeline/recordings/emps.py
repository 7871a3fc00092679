"""Measurements of EMPS, a prismatic positioning axis and a public benchmark of system identification.

A. Janot, M. Gautier and M. Brunot, "Data set and reference models of EMPS", Workshop on nonlinear system
identification benchmarks, 2019.
"""

import math
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.io import loadmat, whosmat

from pipeline.recordings.log_folder import Experiment, Recording, parts
from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.base.limits import check_file, check_memory, limited_process
from unmodelled.base.workers import pool_of

#: The two recordings of the same motion: alone, and with pulses of 5 V added to the drive's voltage.
FILES = {"plain": "DATA_EMPS.mat", "pulses": "DATA_EMPS_PULSES.mat"}
#: Time (s), voltage of the drive with the pulses in it (V), measured position (m).
COLUMNS = ("t", "vir", "qm")
#: Processor time that reading a recording may take; it takes a tenth of a second.
SECONDS = 60.0


@dataclass(frozen=True)
class EmpsRecording(Recording):
    """The recordings as a log folder, each divided into equally long experiments that form a group.

    The motion of a recording is repeated four times. Each of five parts contains both directions and all
    speeds except one or two, and begins elsewhere in the motion, so that an effect of time can be
    distinguished from an effect of position or direction.

    Attributes:
        dataset: folder with the files of `FILES`.
        parts: number of experiments per recording; default 5.
    """

    dataset: str | None
    parts: int = 5

    about = {  # noqa: RUF012
        "description": "public measurements of EMPS, a real positioning axis: voltage, position",
        "url": "https://www.nonlinearbenchmark.org/benchmarks/emps",
    }

    def experiments(self) -> list[Experiment]:
        if not self.dataset:
            raise BadInput("source.dataset: must be given: EMPS=<folder with DATA_EMPS.mat>")
        source = Path(str(self.dataset)).expanduser()
        return [
            Experiment(f"{group}_{k}", part, {"group": group})
            for group, name in FILES.items()
            for k, part in enumerate(parts(read(source / name), self.parts, name), start=1)
        ]


def read(path: Path) -> pd.DataFrame:
    """Read the columns `COLUMNS` of one recording."""
    check_file(path)
    if not path.is_file():
        raise BadInput(f"{path}: no such file")
    with pool_of(1) as pool:
        try:
            content = pool.submit(_variables, path).result()
        except BrokenProcessPool:  # SciPy can crash on what is damaged
            content = "it is damaged"
    if isinstance(content, str):
        raise BadInput(f"{path}: not a MATLAB file of version 4 to 7 ({content})")
    columns = {name: _column(path, name, content.get(name)) for name in COLUMNS}
    for name, values in columns.items():
        if len(values) != len(columns["t"]):
            raise BadInput(
                f"{path}: variable {name}: must have {len(columns['t'])} rows like t, got {len(values)}"
            )
    return pd.DataFrame(columns)


def _variables(path: Path) -> dict[str, Any] | str:
    """The variables of a file, or why there are none."""
    try:
        with path.open("rb") as file:
            sizes = {name: math.prod(shape) for name, shape, _ in whosmat(file)}
            check_memory(path, 8 * sum(sizes.get(name, 0) for name in COLUMNS))
            file.seek(0)
            with limited_process(SECONDS):  # what is compressed can be larger than it says
                found = loadmat(file, variable_names=list(COLUMNS))
    except BadInput:
        raise
    except MemoryError:
        return "its variables take more memory than they say"
    except Exception as error:  # there is no common base of what a damaged file can raise
        return (str(error).splitlines() or [type(error).__name__])[0]
    return {name: found[name] for name in COLUMNS if name in found}


def _column(path: Path, name: str, values: Any) -> Array:
    if values is None:
        raise BadInput(f"{path}: variable {name} is missing")
    if values.dtype.kind not in "fiu" or values.ndim != 2 or 1 not in values.shape:
        raise BadInput(
            f"{path}: variable {name}: must be a column of numbers, got {values.shape} {values.dtype}"
        )
    column = np.asarray(values, np.float64).ravel()
    bad = np.flatnonzero(~np.isfinite(column))
    if len(bad):
        raise BadInput(f"{path}: variable {name}: row {bad[0] + 1}: not a finite number")
    return column
