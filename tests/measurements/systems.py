"""Systems and log folders that the tests of measurements share."""

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import sympy as sp
import yaml

from tests.machines.known import EMPTY, Array, refusals
from unmodelled import Logs, read_logs
from unmodelled.systems.model import Constant, Input, Output, Parameter, Port, State, System
from unmodelled.systems.tables import Table

Log = Mapping[str, Array]

theta, omega, i, V, R, L, k, J, F, m = sp.symbols("theta omega i V R L k J F m", real=True)

PARAMETERS = ("R", "ohm", 2.0), ("L", "H", 0.05), ("k", "N m/A", 0.3), ("J", "kg m^2", 0.02)
ANGLE, SPEED = Output("theta", "rad", "angle", theta), Output("omega", "rad/s", "speed", omega)
#: The keys of a mapping for logs of `run`.
PLAIN = {
    "schema": "mapping/1",
    "files": ["*.csv"],
    "time": {"column": "t"},
    "signals": {"angle": "angle", "voltage": {"column": "voltage"}},
    "constants": {"m": 0.5},
}


def motor(outputs: Sequence[Output] = (ANGLE,), input_delay: float = 0.0, inductance: float = 0.05) -> System:
    """A DC motor with its load; its angle is measured unless `outputs` says otherwise."""
    system = replace(
        EMPTY,
        name="motor",
        states=(State("theta", "rad"), State("omega", "rad/s"), State("i", "A", initial=sp.Float(0.5))),
        inputs=(Input("V", "V", "voltage", input_delay),),
        outputs=tuple(outputs),
        operating_point=(Constant("m", "kg"),),
        parameters=tuple(Parameter(*each) for each in PARAMETERS),
        ports=(Port("shaft", "F", "N m", "theta", "omega"),),
        tables=(Table("curve", (0.0, 1.0, 2.0, 3.0), (0.0, 1.0, 4.0, 9.0)),),
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


def rows(log: Log, some: Any) -> dict[str, Array]:
    return {name: column[some] for name, column in log.items()}


def write_tables(folder: Path, logs: Mapping[str, Mapping[str, Any]], suffix: str = "csv") -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    for name, log in logs.items():
        getattr(pd.DataFrame(log), f"to_{suffix}")(folder / f"{name}.{suffix}", index=False)
    return folder


def write_folder(
    folder: Path, logs: Mapping[str, Log], suffix: str = "csv", **columns: Sequence[object]
) -> Path:
    """A log folder with one experiment for each of `logs`; `columns` go to experiments.csv."""
    write_tables(folder, logs, suffix)
    table = {"id": list(logs), "file": [f"{name}.{suffix}" for name in logs], "m": [0.5] * len(logs)}
    pd.DataFrame({**table, **columns}).to_csv(folder / "experiments.csv", index=False)
    return folder


def write(folder: Path, logs: Mapping[str, Mapping[str, Any]], **keys: Any) -> Path:
    """A folder with a CSV file for each of the logs, and a mapping with other keys than `PLAIN`."""
    write_tables(folder, logs)
    content = {key: value for key, value in {**PLAIN, **keys}.items() if value is not None}
    (folder / "mapping.yaml").write_text(yaml.safe_dump(content, sort_keys=False))
    return folder


def refused(place: Path, system: System | None = None) -> str:
    return "\n".join(refusals(lambda: read_logs(place, system or motor())))


def assert_same(found: Logs, expected: Logs, *but: str) -> None:
    """Equal in all fields except for their place, their table of experiments and `but`."""
    for field in fields(Logs):
        if field.name not in ("experiments", "source", *but):
            np.testing.assert_equal(getattr(found, field.name), getattr(expected, field.name), field.name)
