"""Systems whose motion is known without the code under test, and measured experiments of them."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from tests.machines.folders import logs_of
from unmodelled.base.arrays import Array
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System
from unmodelled.systems.reader import read_system

Rate = Callable[[float, Array, float], list[float]]

SYSTEMS = Path(__file__).parents[2] / "systems"
PENDULUM = SYSTEMS / "pendulum.yaml"

SLED = """
schema: system/1
name: sled
states: {v: {unit: m/s}}
inputs: {F: {unit: N}}
outputs:
  v: {unit: m/s}
parameters: {m: {value: 2.0, unit: kg}}
ports: {rail: {effort: F_r, unit: N, velocity: v}}
dynamics: {v: (F - F_r)/m}
"""


def clock(n: int, period: float = 0.002) -> Array:
    """Times of `n` samples, s."""
    return np.asarray(np.arange(n) * period)


def drive(t: Array, i: int) -> Array:
    """An input of two sines, another for every experiment `i`."""
    return np.asarray(np.sin((3.0 + i) * t) + 0.4 * np.sin((7.0 + 2.0 * i) * t + 1.0))


def truth(rate: Rate, t: Array, u: Array, x0: list[float]) -> Array:
    """States (n, states) by an adaptive method; the input runs straight from sample to sample."""

    def f(time: float, x: Array) -> list[float]:
        return rate(time, x, float(np.interp(time, t, u)))

    found = solve_ivp(f, (t[0], t[-1]), x0, "DOP853", t, rtol=1e-10, atol=1e-12, max_step=t[1] - t[0])
    return np.asarray(found.y.T)


def swing(friction: float = 0.0) -> Rate:
    """Rates of the pendulum, with friction that its file does not have."""

    def rate(t: float, x: Array, u: float) -> list[float]:
        theta, omega = x
        load = friction * math.tanh(omega / 0.05)
        return [omega, (u - 0.01 * omega - 1.2 * math.sin(theta) - load) / 0.02]

    return rate


def pendulum_logs(
    folder: Path, sigma: float = 0.0, friction: float = 0.0, lengths: tuple[int, ...] = (400, 333)
) -> Logs:
    """Experiments of the pendulum; noise of the angle has the standard deviation `sigma`."""
    rng, experiments = np.random.default_rng(0), []
    for i, n in enumerate(lengths):
        t, u = clock(n), drive(clock(n), i)
        theta = truth(swing(friction), t, u, [0.3, 0.0])[:, 0]
        experiments.append({"t": t, "theta": theta + sigma * rng.standard_normal(n), "torque": u})
    return logs_of(read_system(PENDULUM), folder, experiments)


def sled_logs(system: System, folder: Path, friction: float, lengths: tuple[int, ...]) -> Logs:
    """A sled that never turns round: its speed is known in closed form."""
    experiments = []
    for n in lengths:
        t = clock(n, 0.01)
        F = 4.0 + 3.0 * np.cos(4.0 * t)
        v = 1.0 + np.concatenate([[0.0], np.cumsum(0.5 * (F[1:] + F[:-1]) * 0.01)]) / 2.0 - friction / 2.0 * t
        experiments.append({"t": t, "v": v, "F": F})
    return logs_of(system, folder, experiments)
