"""Planted polarisation of a battery, whose system file has no ports: named, with its numbers."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.machines.folders import diagnosed, write_runs

CELL = """
schema: system/1
name: cell
states:
  soc: {unit: "1", initial: 0.9}
inputs:
  i: {unit: A, commanded: false}
outputs:
  v: {unit: V, expression: E0 + k*soc - R*i}
parameters:
  Q: {value: 7200, unit: A s}
  E0: {value: 3.3, unit: V, identify: true, bounds: [3, 3.6]}
  k: {value: 0.8, unit: V, identify: true, bounds: [0.4, 1.2]}
  R: {value: 0.03, unit: ohm, identify: true, bounds: [0.005, 0.1]}
dynamics:
  soc: -i/Q
"""
PERIOD, SAMPLES, RUNS = 1.0, 900, 8
RESISTANCE, TIME = 0.02, 45.0  # ohm, s


def record(folder: Path, charges: Sequence[float] = (0.9,) * RUNS) -> Path:
    """Pulses of current that are held between samples, from a charge each; the branch is advanced exactly."""
    rng, tables = np.random.default_rng(0), []
    kept = np.exp(-PERIOD / TIME)
    for charge in charges:
        pulses = rng.choice([0.0, 1.0, 2.0, 4.0, -1.5], SAMPLES // 60)
        i, branch = np.repeat(pulses, 60), [0.0]
        for before in i[:-1]:
            branch.append(kept * branch[-1] + (1.0 - kept) * RESISTANCE * before)
        soc = charge - np.concatenate([[0.0], np.cumsum(i[:-1])]) * PERIOD / 7200.0
        v = 3.3 + 0.8 * soc - 0.025 * i - branch + 1e-3 * rng.standard_normal(SAMPLES)
        tables.append(pd.DataFrame({"t": PERIOD * np.arange(SAMPLES), "i": i, "v": v}))
    return write_runs(folder, tables)


@pytest.mark.long
@pytest.mark.parametrize("lowest", [pytest.param(0.9, id="full"), pytest.param(0.4, id="at other charges")])
def test_the_slow_part_of_the_voltage_is_named(tmp_path: Path, lowest: float) -> None:
    """The file says that the battery is full; where it starts is read from its voltage."""
    answer = diagnosed(tmp_path, CELL, record(tmp_path / "logs", np.linspace(lowest, 0.9, RUNS).tolist()))
    (effect,) = answer.effects
    assert (answer.verdict, effect.family, effect.port) == ("effect", "rc_branch", "sensor:v")
    assert effect.parameters["R_1"]["value"] == pytest.approx(-RESISTANCE, rel=0.05)
    assert effect.parameters["tau_1"]["value"] == pytest.approx(TIME, rel=0.05)
    assert effect.parameters["R_1"]["unit"] == "ohm"
