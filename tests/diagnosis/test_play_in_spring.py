"""Planted play in a coupling whose spring the file has: named, with its width."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import unmodelled
from tests.machines.folders import write_runs

Array = NDArray[np.float64]

COUPLING = Path("systems/coupling.yaml")
PERIOD, SAMPLES, RUNS, NOISE = 2e-3, 400, 4, 2e-5
#: rad and N m/rad; the file says 40 N m/rad.
HALF_PLAY, STIFFNESS = 0.005, 42.0


def rates(x: Array, torque: float) -> Array:
    twist = x[0] - x[2]
    loaded = max(abs(twist) - HALF_PLAY, 0.0) * np.sign(twist)
    shaft = STIFFNESS * loaded + 0.1 * (x[1] - x[3])
    return np.array([x[1], (torque - shaft) / 0.01, x[3], shaft / 0.03])


def record(folder: Path) -> None:
    rng, t, tables = np.random.default_rng(3), PERIOD * np.arange(SAMPLES), []
    for _ in range(RUNS):
        rate, phase, size = rng.uniform(4.0, 40.0, 3), rng.uniform(0.0, 6.28, 3), rng.uniform(0.3, 0.8)

        def torque(s: float) -> float:
            return float(size * np.sin(rate * s + phase).sum())  # noqa: B023

        path = solve_ivp(
            lambda s, x: rates(x, torque(s)),
            (0.0, t[-1]),
            np.zeros(4),
            t_eval=t,
            rtol=1e-8,
            atol=1e-10,
            max_step=PERIOD,
        ).y
        q1, q2 = path[[0, 2]] + NOISE * rng.standard_normal((2, SAMPLES))
        tables.append(pd.DataFrame({"t": t, "u": [torque(s) for s in t], "q1": q1, "q2": q2}))
    write_runs(folder, tables)


@pytest.mark.long
def test_play_in_the_spring_of_a_coupling(tmp_path: Path) -> None:
    record(tmp_path / "logs")
    known = unmodelled.read_system(COUPLING)
    answer = unmodelled.diagnose(known, unmodelled.read_logs(tmp_path / "logs", known))
    (effect,) = answer.effects
    assert (answer.verdict, effect.family, effect.port) == ("effect", "backlash", "shaft")
    assert effect.law == "-k*(x_0 + clip(twist - x_0, -delta, delta))"
    width, centre = effect.parameters["delta"], effect.parameters["x_0"]
    assert width["interval"][0] <= HALF_PLAY <= width["interval"][1] < 1.01 * HALF_PLAY
    assert width["unit"] == "rad"
    assert centre["interval"][0] <= 0.0 <= centre["interval"][1]
    spring = answer.parameters.set_index("name").loc["k"]
    assert abs(spring["identified"] - STIFFNESS) < 0.01 * STIFFNESS
