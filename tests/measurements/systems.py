"""Systems and log folders that the tests of measurements share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import sympy as sp
from numpy.typing import NDArray

from unmodelled.systems.model import Constant, Input, Output, Parameter, Port, State, System
from unmodelled.systems.tables import Table

Array = NDArray[np.float64]
Log = Mapping[str, Array]

theta, omega, i, V, R, L, k, J, F, m = sp.symbols("theta omega i V R L k J F m", real=True)

PARAMETERS = tuple(
    Parameter(name, unit, value)
    for name, unit, value in [("R", "ohm", 2.0), ("L", "H", 0.05), ("k", "N m/A", 0.3), ("J", "kg m^2", 0.02)]
)


def motor(
    outputs: Sequence[Output] | None = None, input_delay: float = 0.0, inductance: float = 0.05
) -> System:
    """A DC motor with its load; its angle is measured unless `outputs` says otherwise."""
    shown = outputs if outputs is not None else [Output("theta", "rad", "angle", theta)]
    system = System(
        name="motor",
        states=(State("theta", "rad"), State("omega", "rad/s"), State("i", "A", initial=sp.Float(0.5))),
        inputs=(Input("V", "V", "voltage", input_delay),),
        outputs=tuple(shown),
        operating_point=(Constant("m", "kg"),),
        parameters=PARAMETERS,
        ports=(Port("shaft", "F", "N m", "theta", "omega"),),
        tables=(Table("curve", (0.0, 1.0, 2.0, 3.0), (0.0, 1.0, 4.0, 9.0)),),
        signals={},
        dynamics=(omega, (k * i - F) / (J + m), (V - R * i - k * omega) / L),
    )
    return system.with_values({"L": inductance})


def run(n: int = 400, period: float = 0.002, rate: float = 3.0) -> dict[str, Array]:
    """A log of the angle and the voltage, with the columns of other sensors."""
    t = np.arange(n) * period
    return {
        "t": t,
        "angle": np.sin(rate * t) + 0.1 * t,
        "speed": rate * np.cos(rate * t) + 0.1,
        "voltage": 6.0 + np.sign(np.sin(5.0 * t + 0.1)),
    }


def write_folder(
    folder: Path, logs: Mapping[str, Log], suffix: str = "csv", **columns: Sequence[object]
) -> Path:
    """A log folder with one experiment for each of `logs`; `columns` go to experiments.csv."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, log in logs.items():
        if suffix == "csv":
            pd.DataFrame(log).to_csv(folder / f"{name}.csv", index=False)
        else:
            pd.DataFrame(log).to_parquet(folder / f"{name}.{suffix}", index=False)
    table = {"id": list(logs), "file": [f"{name}.{suffix}" for name in logs], "m": [0.5] * len(logs)}
    pd.DataFrame({**table, **columns}).to_csv(folder / "experiments.csv", index=False)
    return folder
