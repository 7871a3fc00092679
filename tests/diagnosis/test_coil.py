"""Planted saturation of a coil with an iron core: named, with the current at which it sets in."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.machines.folders import diagnosed, write_runs

COIL = """
schema: system/1
name: coil
states:
  i: {unit: A}
inputs:
  u: {unit: V}
outputs:
  i: {unit: A}
parameters:
  L: {value: 0.012, unit: H, identify: true, bounds: [0.002, 0.05]}
  R: {value: 1.1, unit: ohm, identify: true, bounds: [0.2, 5]}
ports:
  winding: {effort: e, unit: V, velocity: i}
dynamics:
  i: (u - R*i - e)/L
"""
PERIOD, SAMPLES, RUNS, SUBSTEPS = 2e-4, 600, 8, 10


def inductance(current: float) -> float:
    """Another form than that of the library: the slope of a hyperbolic tangent, and leakage."""
    return 0.002 + 0.008 / np.cosh(current / 2.5) ** 2


def record(folder: Path) -> Path:
    rng, t, tables = np.random.default_rng(0), PERIOD * np.arange(SAMPLES), []
    for _ in range(RUNS):
        rate, phase = rng.uniform(40.0, 250.0, 3), rng.uniform(0.0, 6.28, 3)
        u = 3.0 * np.sin(rate * t[:, None] + phase).sum(1)
        i = [0.0]
        for k in range(SAMPLES - 1):
            now = i[-1]
            for share in (np.arange(SUBSTEPS) + 0.5) / SUBSTEPS:
                voltage = u[k] + share * (u[k + 1] - u[k])
                now += PERIOD / SUBSTEPS * (voltage - 1.0 * now) / inductance(now)
            i.append(now)
        seen = np.array(i) + 1e-3 * rng.standard_normal(SAMPLES)
        tables.append(pd.DataFrame({"t": t, "u": u, "i": seen}))
    return write_runs(folder, tables)


@pytest.mark.long
def test_the_core_of_a_coil_saturates(tmp_path: Path) -> None:
    answer = diagnosed(tmp_path, COIL, record(tmp_path / "logs"))
    assert answer.verdict in ("effect", "main_effect")
    first = answer.effects[0]
    assert (first.family, first.port) == ("inductance_saturation", "winding")
    assert first.shrink > 0.9
    # half of what can vanish has vanished where the tangent's slope has fallen to a half
    assert first.parameters["i_s"]["value"] == pytest.approx(2.5 * np.arccosh(2.0**0.5), rel=0.25)
    assert first.parameters["i_s"]["unit"] == "A"
