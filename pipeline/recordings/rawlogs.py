"""Read the raw logs of the cam-follower bench: a zip file (or folder) of seven-row CSV files.

`Dataset/parameters.csv` has the columns exp, H, beta, m, V; `Dataset/experiments/exp<i>.csv` has the rows
t, theta, omega, alpha, y, h, eps without a header.
"""

import io
import re
from pathlib import Path, PurePosixPath

import numpy as np
import pandas as pd

from pipeline.recordings.archive import Archive
from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.base.limits import NUMBERS, check_file, check_memory

ROWS = ("t", "theta", "omega", "alpha", "y", "h", "eps")
FACTORS = ("H", "beta", "m", "V")
PERIOD = 0.0005  # s, the bench logs at 2 kHz
TOLERANCE = 0.01  # relative, on the median period
LONGEST_GAP = 5.0  # sampling periods
SHORTEST_LOG = 50  # samples
COPIES = 4  # of a log's text, while its lines are told apart and read


class RawLogs(Archive):
    """The archive of a campaign."""

    def __init__(self, path: Path) -> None:
        super().__init__(str(path), "DATASET")
        check_file(path)
        self._logs = {PurePosixPath(n).name: n for n in self.members if n.endswith(".csv")}
        if "parameters.csv" not in self._logs:
            raise BadInput(f"{path}: holds no parameters.csv")
        check_memory(path, NUMBERS * sum(map(self.size, self._logs.values())))

    def parameters(self) -> pd.DataFrame:
        """Return the columns exp, H, beta, m and V, one row per experiment, sorted by exp."""
        name = self._logs["parameters.csv"]
        table = self.table(name, ("exp", *FACTORS))
        return self._checked(table.astype({"exp": np.int32}), self.where(name))

    def _checked(self, table: pd.DataFrame, where: str) -> pd.DataFrame:
        twice = table["exp"].duplicated()
        if twice.any():
            row = int(np.flatnonzero(twice)[0])
            raise BadInput(f"{where}: row {row + 2}: column exp: experiment {table['exp'].iloc[row]} twice")
        logged = {int(k.group(1)) for n in self._logs if (k := re.fullmatch(r"exp(\d+)\.csv", n))}
        listed = set(table["exp"].tolist())
        if missing := sorted(listed - logged):
            raise BadInput(f"{self.path}: exp{missing[0]}.csv is missing, parameters.csv lists it")
        if missing := sorted(logged - listed):
            raise BadInput(f"{where}: column exp: experiment {missing[0]} is missing, it has a log")
        return table.sort_values("exp", ignore_index=True)

    def log(self, exp: int) -> Array:
        """Return the validated log of an experiment; gives (7, n)."""
        name = f"exp{exp}.csv"
        if name not in self._logs:
            raise BadInput(f"{self.path}: holds no {name}")
        where = f"{self.path.name}: {name}"
        return validate(parse(self.read(self._logs[name], COPIES + NUMBERS), where), where)


def parse(text: bytes, where: str) -> Array:
    """Read the numbers of a seven-row CSV file; gives (7, n)."""
    lines = text.replace(b"\r", b"").rstrip(b"\n").split(b"\n")
    if len(lines) != len(ROWS):
        raise BadInput(f"{where}: must have {len(ROWS)} rows ({', '.join(ROWS)}), got {len(lines)}")
    counts = [line.count(b",") + 1 for line in lines]
    for row, count in enumerate(counts):
        if count != counts[0]:
            raise BadInput(
                f"{where}: row {row + 1} ({ROWS[row]}): must have {counts[0]} columns like row 1, got {count}"
            )
    try:
        return np.loadtxt(io.BytesIO(b"\n".join(lines)), delimiter=",", comments=None, ndmin=2)
    except ValueError:
        raise BadInput(f"{where}: {_first_bad_cell(lines)}") from None


def _first_bad_cell(lines: list[bytes]) -> str:
    for row, line in enumerate(lines):
        for column, cell in enumerate(line.split(b",")):
            try:
                float(cell)
            except ValueError:
                shown = cell.decode(errors="replace")[:30]
                return f"row {row + 1} ({ROWS[row]}) column {column + 1}: {shown!r} is not a number"
    return "a cell is not a number"


def validate(log: Array, where: str) -> Array:
    """Check that the signals of a log are physically possible. Takes log (7, n); gives (7, n)."""
    bad = np.argwhere(~np.isfinite(log))
    if len(bad):
        row, column = bad[0]
        raise BadInput(f"{where}: row {row + 1} ({ROWS[row]}) column {column + 1}: not a finite number")
    if log.shape[1] < SHORTEST_LOG:
        raise BadInput(f"{where}: must have at least {SHORTEST_LOG} columns, got {log.shape[1]}")
    steps = np.diff(log[0])
    period = float(np.median(steps))
    # with five significant digits two neighbours read the same once a digit is longer than a period
    resolution = 10.0 ** (np.floor(np.log10(np.maximum(np.abs(log[0, 1:]), 1e-9))) - 4.0)
    back = np.flatnonzero((steps < 0) | ((steps == 0) & (resolution < period)))
    if len(back):
        raise BadInput(f"{where}: row 1 (t) column {back[0] + 2}: time must increase")
    if abs(period / PERIOD - 1.0) > TOLERANCE:
        raise BadInput(
            f"{where}: row 1 (t): sampling period must be {PERIOD} s within 1 %, got {period:.6g} s"
        )
    gap = np.flatnonzero(steps > LONGEST_GAP * period)
    if len(gap):
        raise BadInput(
            f"{where}: row 1 (t) column {gap[0] + 2}: time is not uniform, gap of {steps[gap[0]]:.4g} s"
        )
    for row in (1, 4):
        if np.ptp(log[row]) == 0.0:
            raise BadInput(
                f"{where}: row {row + 1} ({ROWS[row]}): dead sensor, every column is {log[row, 0]:g}"
            )
    return log
