"""Faults of loggers, planted in right logs: unit, sign, offset, clock, assignment, single samples."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from unmodelled.systems.model import System

Runs = list[pd.DataFrame]
Plant = Callable[[System, Runs, np.random.Generator], list[str]]

TIME = "t"
#: Factor of the clock of one run; offset of one run, and size of a spike, in ranges of the output.
FAST, SHIFTED, SPIKE = 1.25, 2.0, 20.0
#: Share of the samples that are spikes, and share of a run during which an output is frozen.
SPIKES, FROZEN = 0.003, 0.08


@dataclass(frozen=True)
class Fault:
    """A fault of logs."""

    name: str
    decides: bool  # the right answer is to check the logs; otherwise it is safe to cure
    change: Plant  # changes the tables of the runs; returns channels that a right answer may name

    def plant(self, system: System, logs: Path, rng: np.random.Generator) -> list[str]:
        """Change the files of a log folder; return the channels that a right answer may name."""
        files = [logs / name for name in pd.read_csv(logs / "experiments.csv")["file"]]
        runs = [pd.read_csv(file) if file.suffix == ".csv" else pd.read_parquet(file) for file in files]
        runs = [run.astype(float) for run in runs]  # a column of integers takes no factor
        channels = self.change(system, runs, rng)
        for file, run in zip(files, runs, strict=True):
            if file.suffix == ".csv":
                run.to_csv(file, index=False, float_format="%.9g")
            else:
                run.to_parquet(file)
        return channels


def _scaled(system: System, runs: Runs, factor: float) -> list[str]:
    (name, *_) = (item.name for item in system.inputs)
    for run in runs:
        run[name] *= factor
    return [name]


def _reversed(system: System, runs: Runs, rng: np.random.Generator) -> list[str]:
    """Of a symmetric machine, the sign of all outputs may be wrong as well."""
    return [*_scaled(system, runs, -1.0), *(o.name for o in system.outputs)]


def _unit(system: System, runs: Runs, rng: np.random.Generator) -> list[str]:
    """The first output, in degrees where it is an angle, and in thousandths of its unit elsewhere."""
    output = system.outputs[0]
    for run in runs:
        run[output.name] *= 180.0 / np.pi if output.unit.startswith("rad") else 1000.0
    return [output.name]


def _shifted(system: System, runs: Runs, rng: np.random.Generator) -> list[str]:
    output = system.outputs[0].name
    size = max(float(np.ptp(run[output])) for run in runs)
    runs[rng.integers(len(runs))][output] += SHIFTED * size
    return [output]


def _clock(system: System, runs: Runs, rng: np.random.Generator) -> list[str]:
    runs[rng.integers(len(runs))][TIME] *= FAST
    return [TIME]


def _swapped(system: System, runs: Runs, rng: np.random.Generator) -> list[str]:
    """The inputs of two runs, as far as the shorter one goes."""
    one, other = (runs[k] for k in rng.choice(len(runs), 2, replace=False))
    names = [item.name for item in system.inputs]
    rows = min(len(one), len(other))
    first, second = one.loc[: rows - 1, names].copy(), other.loc[: rows - 1, names].copy()
    one.loc[: rows - 1, names], other.loc[: rows - 1, names] = second.to_numpy(), first.to_numpy()
    return names


def _other_signal(system: System, runs: Runs, rng: np.random.Generator) -> list[str]:
    """Another signal in the column of an input: as fast and as large, and independent of it."""
    (name, *_) = (item.name for item in system.inputs)
    for run in runs:
        spectrum = np.fft.rfft(run[name].to_numpy())
        turned = spectrum * np.exp(2j * np.pi * rng.uniform(size=len(spectrum)))
        run[name] = np.fft.irfft(turned, len(run))
    return [name]


def _spikes(system: System, runs: Runs, rng: np.random.Generator) -> list[str]:
    output = system.outputs[0].name
    size = max(float(np.ptp(run[output])) for run in runs)
    for run in runs:
        at = rng.choice(len(run), max(1, round(SPIKES * len(run))), replace=False)
        run.loc[at, output] += SPIKE * size * rng.choice([-1.0, 1.0], len(at))
    return [output]


def _frozen(system: System, runs: Runs, rng: np.random.Generator) -> list[str]:
    output, run = system.outputs[0].name, runs[rng.integers(len(runs))]
    begin, width = round(rng.uniform(0.3, 0.6) * len(run)), round(FROZEN * len(run))
    run.loc[begin : begin + width, output] = run[output].iloc[begin]
    return [output]


FAULTS = (
    Fault("reversed", True, _reversed),
    Fault("thousandths", True, lambda system, runs, _: _scaled(system, runs, 1000.0)),
    Fault("unit", True, _unit),
    Fault("shifted", True, _shifted),
    Fault("clock", True, _clock),
    Fault("swapped", True, _swapped),
    Fault("other_signal", True, _other_signal),
    Fault("spikes", False, _spikes),
    Fault("frozen", False, _frozen),
)
