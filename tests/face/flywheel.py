"""The logs of the example flywheel, by the closed form of its motion."""

from pathlib import Path

import numpy as np
import pandas as pd

INERTIA, DAMPING, TORQUE = 0.5, 0.02, 2.0
#: Mean and standard deviation of the brake's torque, in nominal values; rms noise of the sensor, rad/s.
SCATTER, NOISE = (0.9, 0.1), 0.05
RUNS, SAMPLES, PERIOD, START = 24, 120, 0.1, 40.0


def write_logs(folder: Path) -> None:
    """Write a log folder with t (s) and omega (rad/s) in every run."""
    folder.mkdir(parents=True)
    rng = np.random.default_rng(0)
    t = PERIOD * np.arange(SAMPLES)
    ids = [f"run{k + 1}" for k in range(RUNS)]
    for name in ids:
        torque = TORQUE * rng.normal(*SCATTER)
        final = torque / DAMPING
        omega = (START + final) * np.exp(-DAMPING * t / INERTIA) - final
        noisy = omega + rng.normal(0.0, NOISE, SAMPLES)
        pd.DataFrame({"t": t, "omega": noisy}).to_csv(
            folder / f"{name}.csv", index=False, float_format="%.4f"
        )
    pd.DataFrame({"id": ids, "file": [f"{name}.csv" for name in ids]}).to_csv(
        folder / "experiments.csv", index=False
    )
