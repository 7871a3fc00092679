"""Small machines whose logs take every fault that a look can find."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pandas as pd

from tests.machines.folders import Array, motion, text_of


@dataclass(frozen=True)
class Machine:
    """A machine with its system file.

    Attributes:
        system: text of the system file.
        rates: function of states (states, runs) and inputs (runs,) to the rates of the states.
        states: number of states.
        force: size of the input.
        period: sampling period, s.
        logged: function of states (states, runs, samples) and random generator to columns (runs, samples).
        drive: name of the column of the input.
        start: first state at the beginning of the runs, default 0.
        inputs: function of the inputs (runs, samples) to those that are used, default the same.
    """

    system: str
    rates: Callable[[Array, Array], Array]
    states: int
    force: float
    period: float
    logged: Callable[[Array, np.random.Generator], dict[str, Array]]
    drive: str
    start: float = 0.0
    inputs: Callable[[Array], Array] = lambda u: u

    def frames(self, seed: int = 0, runs: int = 4, samples: int = 1200) -> dict[str, pd.DataFrame]:
        """Return faultless logs of runs with inputs of several sines."""
        rng, t = np.random.default_rng(seed), self.period * np.arange(samples)
        u = self.inputs(self.force * np.array([_sines(t, rng) for _ in range(runs)]))
        columns = {self.drive: u, **self.logged(self.states_at(u), rng)}
        return {
            f"run{k + 1}": pd.DataFrame({"t": t, **{name: values[k] for name, values in columns.items()}})
            for k in range(runs)
        }

    def states_at(self, u: Array) -> Array:
        """Return states (states, runs, samples) for inputs (runs, samples)."""
        x = np.zeros((self.states, len(u)))
        x[0] = self.start * np.linspace(0.5, 1.0, len(u))
        return np.moveaxis(motion(self.rates, x, u.T, self.period), 0, -1)


def _sines(t: Array, rng: np.random.Generator) -> Array:
    f, phase = np.exp(rng.uniform(np.log(0.2), np.log(2.0), 6)), rng.uniform(0.0, 2.0 * np.pi, 6)
    return np.asarray(np.sin(2.0 * np.pi * np.outer(f, t) + phase[:, None]).sum(axis=0) / 3.0)


def rounded(values: Array, step: float) -> Array:
    return step * np.round(values / step)


#: Ball screw with an encoder of 2 um a count.
SCREW = Machine(
    text_of("screw.yaml"),
    lambda x, u: np.array([x[1], (u - 40.0 * x[1]) / 12.0]),
    states=2,
    force=40.0,
    period=0.004,
    logged=lambda x, rng: {"s": rounded(x[0], 2e-6)},
    drive="force",
)
#: Pendulum with a noisy angle and a tachometer.
PENDULUM = Machine(
    text_of("swing.yaml"),
    lambda x, u: np.array([x[1], (u - 2.0 * np.sin(x[0]) - 0.05 * x[1]) / 0.05]),
    states=2,
    force=0.6,
    period=0.005,
    logged=lambda x, rng: {
        "phi": x[0] + 1e-3 * rng.standard_normal(x[0].shape),
        "tacho": x[1] + 0.02 * rng.standard_normal(x[1].shape),
    },
    drive="torque",
)
#: Heater with a thermocouple behind a converter of 0.05 K, and no position.
HEATER = Machine(
    text_of("heater.yaml"),
    lambda x, u: np.array([(u - 2.0 * x[0]) / 20.0]),
    states=1,
    force=200.0,
    period=0.02,
    logged=lambda x, rng: {"T": rounded(x[0] + 0.1 * rng.standard_normal(x[0].shape), 0.05)},
    drive="power",
)
MACHINES = {"screw": SCREW, "swing": PENDULUM, "heater": HEATER}
