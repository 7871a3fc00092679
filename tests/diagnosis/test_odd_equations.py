"""Equations without a value for some measured states: their windows diverge, and take no finer steps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.machines.folders import logs_of, system_of
from unmodelled.diagnosis.fitting.free_runs import free_runs

TANK = """
schema: system/1
name: tank
states: {h: {unit: m}}
inputs: {q: {unit: m^3/s}}
outputs: {h: {unit: m}}
parameters: {A: {value: 0.5, unit: m^2}, a: {value: 0.02, unit: m^2}, G: {value: 19.62, unit: m/s^2},
  edge: {value: 0.5, unit: m}, e: {value: 1.0e-5, unit: m^3/s}}
dynamics: {h: LAW}
"""


@pytest.mark.parametrize(
    ("law", "diverges"),
    [
        ("(q - a*sqrt(G*(h - edge)))/A", True),
        ("(q - a*sqrt(G*abs(h - edge)) - e*log((h - edge)/edge))/A", True),
        ("(q - a*sqrt(G*(h - 0.1*edge)))/A", False),
    ],
)
def test_windows_without_a_value_take_no_finer_steps(tmp_path: Path, law: str, diverges: bool) -> None:
    """Levels of half of the runs lie below the edge, where the file has the root of a negative number."""
    t, rng, tables = 0.5 * np.arange(240), np.random.default_rng(2), []
    for run in range(6):
        h, levels = 0.15 + 0.12 * run, []
        q = np.repeat(rng.uniform(0.02, 0.08, 8), 30)
        for inflow in q:
            levels.append(h)
            h += 0.5 * (inflow - 0.02 * np.sqrt(19.62 * max(h - 0.05, 0.0))) / 0.5
        tables.append(pd.DataFrame({"t": t, "q": q, "h": levels + 1e-3 * rng.standard_normal(240)}))
    system = system_of(TANK.replace("LAW", law), tmp_path)
    found = free_runs(system, logs_of(system, tmp_path / "logs", tables), horizon=20.0)
    assert any("diverged" in note for note in found.notes) is diverges
    assert found.substeps <= 8
    assert not any("has not converged" in note for note in found.notes)
