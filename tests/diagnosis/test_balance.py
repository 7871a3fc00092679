"""Planted losses of a house and of a tank: named, with their numbers."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import unmodelled

HOUSE = """
schema: system/1
name: house
states:
  T: {unit: K}
inputs:
  P: {unit: W}
outputs:
  T: {unit: K}
parameters:
  C: {value: 2.3e+6, unit: J/K, identify: true, bounds: [5.0e+5, 1.0e+7]}
ports:
  air: {effort: q, unit: W, position: T}
dynamics:
  T: (P - q)/C
"""
TANK = """
schema: system/1
name: tank
states:
  h: {unit: m}
inputs:
  q_in: {unit: m^3/s}
outputs:
  h: {unit: m}
parameters:
  A: {value: 0.5, unit: m^2}
  k: {value: 0.023, unit: m^2.5/s, identify: true, bounds: [0.005, 0.1]}
ports:
  vessel: {effort: q, unit: m^3/s, position: h}
dynamics:
  h: (q_in - k*sqrt(max(h, 0)) - q)/A
"""
RUNS, SAMPLES = 8, 300


def logs(
    folder: Path, names: tuple[str, str], period: float, levels: list[float], start: tuple[float, float],
    rate: Callable[[float, float], float], noise: float,
) -> Path:  # fmt: skip
    """A folder of runs with steps of the input, integrated in ten substeps per sample."""
    rng, rows = np.random.default_rng(0), []
    folder.mkdir()
    for run in range(RUNS):
        u = np.repeat(rng.choice(levels, SAMPLES // 30), 30)
        x = [float(rng.uniform(*start))]
        for value in u[:-1]:
            level = x[-1]
            for _ in range(10):
                level += 0.1 * period * rate(level, float(value))
            x.append(level)
        seen = np.array(x) + noise * rng.standard_normal(SAMPLES)
        table = {"t": period * np.arange(SAMPLES), names[0]: u, names[1]: seen}
        pd.DataFrame(table).to_csv(folder / f"run{run}.csv", index=False)
        rows.append({"id": f"run{run}", "file": f"run{run}.csv"})
    pd.DataFrame(rows).to_csv(folder / "experiments.csv", index=False)
    return folder


def diagnosed(folder: Path, system: str, recorded: Path) -> unmodelled.Answer:
    (folder / "system.yaml").write_text(system)
    known = unmodelled.read_system(folder / "system.yaml")
    return unmodelled.diagnose(known, unmodelled.read_logs(recorded, known))


def test_the_heat_that_a_house_loses_to_its_surroundings(tmp_path: Path) -> None:
    recorded = logs(
        *(tmp_path / "logs", ("P", "T"), 120.0, [0.0, 1500.0, 3000.0, 4500.0], (285.0, 297.0)),
        lambda T, P: (P - 120.0 * (T - 278.0)) / 2.0e6,
        0.02,
    )
    answer = diagnosed(tmp_path, HOUSE, recorded)
    (effect,) = answer.effects
    assert (answer.verdict, effect.family, effect.port) == ("effect", "linear_loss", "air")
    assert effect.parameters["k"]["value"] == pytest.approx(120.0, rel=0.02)
    assert effect.parameters["k"]["unit"] == "W/K"
    assert effect.parameters["x_a"]["value"] == pytest.approx(278.0, abs=0.3)


def test_the_overflow_of_a_tank(tmp_path: Path) -> None:
    recorded = logs(
        *(tmp_path / "logs", ("q_in", "h"), 1.0, [0.0, 0.01, 0.02, 0.03, 0.05], (0.3, 1.0)),
        lambda h, q: (q - 0.02 * max(h, 0.0) ** 0.5 - 0.3 * max(h - 1.2, 0.0) ** 1.5) / 0.5,
        0.001,
    )
    answer = diagnosed(tmp_path, TANK, recorded)
    assert answer.verdict in ("effect", "main_effect")
    assert (answer.effects[0].family, answer.effects[0].port) == ("overflow", "vessel")
    assert answer.effects[0].parameters["x_o"]["value"] == pytest.approx(1.2, abs=0.06)
    assert answer.effects[0].shrink > 0.9
