"""Virtual pendulum bench: a driven pendulum with dry friction in its joint, logged by an encoder.

A small campaign for first steps with the tools. A model of a pendulum usually leaves out the dry friction.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.integrate import solve_ivp

from pipeline.rigs.virtual import VirtualCampaign
from unmodelled.base.arrays import Array

TURN = 2 * float(np.pi)


@dataclass(frozen=True)
class PendulumCampaign(VirtualCampaign):
    """Runs of the bench with random multi-sine torques, as a log folder with t, torque and theta.

    Attributes:
        runs: number of runs.
        duration: duration of a run, s.
        period: sampling period of the logger, s.
        inertia: moment of inertia J, kg m^2.
        damping: coefficient of viscous friction b, N m s/rad.
        weight: weight times distance of the centre of mass from the joint, N m.
        coulomb: dry friction torque, N m.
        creep: speed over which the dry friction changes its sign, rad/s.
        counts: counts of the encoder per turn.
        torque: amplitude of the drive, N m.
    """

    runs: int = 6
    duration: float = 4.0
    period: float = 0.002
    inertia: float = 0.02
    damping: float = 0.015
    weight: float = 1.2
    coulomb: float = 0.06
    creep: float = 0.02
    counts: int = 8192
    torque: float = 0.6

    description = "simulated logs of a virtual pendulum bench with dry friction, not measurements"

    def make(self, out: Path, seed: int) -> int:
        ids = [f"run{k + 1}" for k in range(self.runs)]
        for k, name in enumerate(ids):
            log = self._run(np.random.default_rng([seed, k]))
            pd.DataFrame(log).to_csv(out / f"{name}.csv", index=False, float_format="%.9g")
        files = [f"{name}.csv" for name in ids]
        pd.DataFrame({"id": ids, "file": files}).to_csv(out / "experiments.csv", index=False)
        return self.runs

    def _run(self, rng: np.random.Generator) -> dict[str, Array]:
        frequencies, phases = rng.uniform(0.2, 2.5, 4), rng.uniform(0.0, TURN, 4)

        def torque(t: Any) -> Array:
            waves = np.sin(TURN * np.multiply.outer(t, frequencies) + phases)
            return np.asarray(self.torque * waves.mean(axis=-1) * 2.0)

        def motion(t: float, state: Array) -> list[float]:
            theta, omega = state
            friction = self.damping * omega + self.coulomb * np.tanh(omega / self.creep)
            return [omega, (float(torque(t)) - friction - self.weight * np.sin(theta)) / self.inertia]

        t = np.arange(round(self.duration / self.period)) * self.period
        start = [rng.uniform(-0.8, 0.8), 0.0]
        found = solve_ivp(motion, (0.0, t[-1]), start, "LSODA", t, rtol=1e-8, atol=1e-10)
        step = TURN / self.counts
        return {"t": t, "torque": torque(t), "theta": np.round(found.y[0] / step) * step}
