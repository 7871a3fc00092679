"""Planted heat of a winding, by its physics: resistance named that grows, with its time constant."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.machines.folders import diagnosed, write_runs

WINDING = """
schema: system/1
name: winding
states: {i: {unit: A}}
inputs: {u: {unit: V}}
outputs: {i: {unit: A}}
parameters:
  L: {value: 0.4, unit: H}
  R: {value: 1.8, unit: ohm, identify: true, bounds: [0.5, 5]}
ports: {terminal: {effort: e, unit: V, velocity: i}}
dynamics: {i: (u - R*i - e)/L}
"""
PERIOD, SAMPLES, RUNS, SUBSTEPS, NOISE = 0.02, 600, 6, 10, 2e-3
#: ohm, 1/K of copper, K/W and J/K: a time constant of 6 s.
COLD, COPPER, TO_AIR, HEAT = 2.0, 0.0039, 2.0, 3.0


def record(folder: Path) -> Path:
    rng, t, h = np.random.default_rng(0), PERIOD * np.arange(SAMPLES), PERIOD / SUBSTEPS
    rate, phase = rng.uniform(0.5, 6.0, (2, RUNS)), rng.uniform(0.0, 6.28, (2, RUNS))
    mean, size = rng.uniform(-8.0, 8.0, RUNS), rng.uniform(2.0, 5.0, RUNS)
    u = mean + size * np.sin(rate * t[:, None, None] + phase).sum(1)
    i, warmer, path = np.zeros(RUNS), np.zeros(RUNS), []
    for k in range(SAMPLES):
        path.append(i)
        after = u[min(k + 1, SAMPLES - 1)]
        for share in (np.arange(SUBSTEPS) + 0.5) / SUBSTEPS:
            resistance = COLD * (1.0 + COPPER * warmer)
            slope = (u[k] + share * (after - u[k]) - resistance * i) / 0.4
            middle = i + 0.5 * h * slope
            warmer = warmer + h * (resistance * middle**2 - warmer / TO_AIR) / HEAT
            i = i + h * (u[k] + share * (after - u[k]) - resistance * middle) / 0.4
    seen = np.array(path) + NOISE * rng.standard_normal((SAMPLES, RUNS))
    return write_runs(folder, [pd.DataFrame({"t": t, "u": u[:, k], "i": seen[:, k]}) for k in range(RUNS)])


@pytest.mark.long
def test_the_resistance_of_a_winding_grows_with_its_heat(tmp_path: Path) -> None:
    answer = diagnosed(tmp_path, WINDING, record(tmp_path / "logs"))
    effect = answer.effects[0]
    assert answer.verdict in ("effect", "main_effect")
    assert (effect.family, effect.port) == ("self_heating", "terminal")
    assert effect.shrink > 0.9
    # the warmer winding takes more heat from the same current, which the law leaves out
    assert effect.parameters["tau_h"]["value"] == pytest.approx(TO_AIR * HEAT, rel=0.25)
    assert effect.parameters["k_h"]["value"] == pytest.approx(COLD**2 * COPPER * TO_AIR, rel=0.25)
    assert effect.parameters["k_h"]["unit"] == "ohm/A^2"
