"""What a user hands to `diagnose`: a cart on a rail with its logs, and ways to spoil them."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

Change = Callable[[Path], None]

SYSTEM = """\
schema: system/1
name: cart
states:
  x: {unit: m}
  v: {unit: m/s}
inputs:
  u: {unit: V, column: volts}
outputs:
  x: {unit: m, column: position}
operating_point:
  m: {unit: kg}
parameters:
  M: {value: 2.0, unit: kg}
  kf: {value: 1.5, unit: N/V}
  b: {value: 0.4, unit: N s/m, identify: true, bounds: [0, 5]}
ports:
  rail: {effort: F, unit: N, position: x, velocity: v}
dynamics:
  x: v
  v: (kf*u - b*v - F)/(M + m)
"""
PERIOD, SAMPLES = 0.01, 120


def log(k: int = 0, samples: int = SAMPLES, period: float = PERIOD) -> dict[str, NDArray[np.float64]]:
    """Something that a cart could do."""
    t = period * np.arange(samples)
    return {
        "t": t,
        "position": np.sin((2.0 + k) * t) + 1e-3 * np.cos(40.0 * t),
        "volts": 3.0 * np.cos(5.0 * t + k),
    }


def write_case(folder: Path) -> Path:
    """system.yaml and logs/ with three experiments."""
    logs = folder / "logs"
    logs.mkdir(parents=True)
    (folder / "system.yaml").write_text(SYSTEM)
    for k, name in enumerate("abc"):
        pd.DataFrame(log(k)).round(6).to_csv(logs / f"{name}.csv", index=False)
    (logs / "experiments.csv").write_text("id,file,m\na,a.csv,0.5\nb,b.csv,1.0\nc,c.csv,0.5\n")
    return folder


def system(old: str, new: str) -> Change:
    """Change the text of the system file."""
    assert SYSTEM.count(old) == 1, old
    return lambda folder: write(folder / "system.yaml", SYSTEM.replace(old, new))


def text(path: str, content: str | bytes) -> Change:
    """Replace a file."""
    return lambda folder: write(folder / path, content)


def write(path: Path, content: str | bytes) -> None:
    path.write_bytes(content if isinstance(content, bytes) else content.encode())


def experiments(content: str) -> Change:
    return text("logs/experiments.csv", content)


def cell(row: int, column: int, value: str, path: str = "logs/b.csv") -> Change:
    """Put `value` in a cell, rows and columns counted from 1."""

    def change(folder: Path) -> None:
        rows = [line.split(",") for line in (folder / path).read_text().splitlines()]
        rows[row - 1][column - 1] = value
        write(folder / path, "\n".join(",".join(r) for r in rows) + "\n")

    return change


def columns(**values: NDArray[np.float64] | float) -> Change:
    """Replace columns of the log of experiment b."""
    return lambda folder: pd.DataFrame({**log(1), **values}).to_csv(folder / "logs" / "b.csv", index=False)


def all_columns(samples: int = SAMPLES, period: float = PERIOD, **values: float) -> Change:
    """Write all three logs anew."""

    def change(folder: Path) -> None:
        for k, name in enumerate("abc"):
            made = pd.DataFrame({**log(k, samples, period), **values})
            made.to_csv(folder / "logs" / f"{name}.csv", index=False)

    return change


def without(path: str) -> Change:
    return lambda folder: (folder / path).unlink()
