"""Machines of the tests: system and robot files of this folder, their motions, and log folders."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

import unmodelled
from unmodelled.api.named_effect import NamedEffect
from unmodelled.base.arrays import Array
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System

Table = pd.DataFrame | Mapping[str, Array]
#: Function of states (states, ...) and inputs at one time to the time derivatives of the states.
Rates = Callable[[Array, Array], Array | Sequence[Array | float]]


def changed(text: str, *changes: tuple[str, str]) -> str:
    """A text in which each old part, which must be there, is replaced by a new one."""
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    return text


def text_of(file: str, *changes: tuple[str, str]) -> str:
    """The text of a system file or a robot file of this folder, with changes."""
    return changed((Path(__file__).parent / file).read_text(), *changes)


def system_of(text: str, folder: Path) -> System:
    """The system of a system file with this text, which is written to `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "system.yaml").write_text(text)
    return unmodelled.read_system(folder / "system.yaml")


def motion(
    rates: Rates, start: ArrayLike, u: Array, period: float, substeps: int = 4, held: bool = False
) -> Array:
    """Integrate a machine by Runge and Kutta's method.

    Args:
        rates: time derivatives of the states.
        start: states (states, ...) of the first sample.
        u: inputs (samples, ...).
        period: sampling period, s.
        substeps: steps per sampling period.
        held: whether inputs keep their values between samples; default: they run straight.

    Returns:
        states (samples, states, ...).
    """
    x, h = np.asarray(start, float), period / substeps
    path = [x]
    for before, after in pairwise(u):
        change = (after - before) * (not held)
        for s in range(substeps):
            a, m, b = (before + (s + share) / substeps * change for share in (0.0, 0.5, 1.0))
            k1 = np.asarray(rates(x, a))
            k2 = np.asarray(rates(x + 0.5 * h * k1, m))
            k3 = np.asarray(rates(x + 0.5 * h * k2, m))
            x = x + h / 6.0 * (k1 + 2.0 * (k2 + k3) + np.asarray(rates(x + h * k3, b)))
        path.append(x)
    return np.array(path)


def write_runs(folder: Path, tables: Sequence[Table], **columns: Sequence[object]) -> Path:
    """A folder with a CSV file per run and experiments.csv, which names them run0, run1 and so on.

    `columns` are further columns of experiments.csv, which may have other ids.
    """
    folder.mkdir(parents=True, exist_ok=True)
    names = [f"run{k}" for k in range(len(tables))]
    for name, table in zip(names, tables, strict=True):
        pd.DataFrame(table).to_csv(folder / f"{name}.csv", index=False)
    listed = {"id": names, "file": [f"{name}.csv" for name in names], **columns}
    pd.DataFrame(listed).to_csv(folder / "experiments.csv", index=False)
    return folder


def recorded(folder: Path, run: Callable[[np.random.Generator], Table], runs: int, seed: int = 0) -> Path:
    """A folder of runs, whose tables `run` draws one after the other."""
    rng = np.random.default_rng(seed)
    return write_runs(folder, [run(rng) for _ in range(runs)])


def logs_of(system: System, folder: Path, tables: Sequence[Table], **columns: Sequence[object]) -> Logs:
    """The logs of a log folder that is written of these tables."""
    return unmodelled.read_logs(write_runs(folder, tables, **columns), system)


def read_case(folder: Path) -> tuple[System, Logs]:
    """The system of `folder`/system.yaml and the logs of `folder`/logs."""
    system = unmodelled.read_system(folder / "system.yaml")
    return system, unmodelled.read_logs(folder / "logs", system)


def diagnosed(folder: Path, text: str, recorded: Path) -> unmodelled.Answer:
    """The diagnosis of a log folder by a system file with this text, which is written to `folder`."""
    known = system_of(text, folder)
    return unmodelled.diagnose(known, unmodelled.read_logs(recorded, known))


def only_effect(answer: unmodelled.Answer, family: str, port: str) -> NamedEffect:
    """The one effect of an answer, which must be of this family at this port and explain the gap."""
    (effect,) = answer.effects
    assert (answer.verdict, effect.family, effect.port) == ("effect", family, port)
    return effect


def values_of(effect: NamedEffect) -> list[float]:
    """The numbers of an effect in their order."""
    return [number["value"] for number in effect.parameters.values()]
