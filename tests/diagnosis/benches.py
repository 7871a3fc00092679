"""A pendulum whose faults are known, for the tests of the diagnosis."""

from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np

from tests.machines.folders import Array, changed, logs_of, motion, system_of, text_of
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System

PERIOD = 0.002
TEXT = text_of("pendulum.yaml")
NUMBERS = """  F_c: {value: 0.0, unit: N m, identify: true, bounds: [0, 1]}
  creep: {value: 0.05, unit: rad/s}
ports:"""
FRICTION = (("velocity: omega}", "velocity: omega, law: F_c*tanh(omega/creep)}"), ("ports:", NUMBERS))


def pendulum(folder: Path, *changes: tuple[str, str], text: str = TEXT) -> System:
    """The system of `TEXT`, which knows no friction unless `FRICTION` changes it."""
    return system_of(changed(text, *changes), folder)


@dataclass(frozen=True)
class Bench:
    """What is true: b and mgl are not those of the file, friction is missing there."""

    b: float | tuple[float, ...] = 0.015  # of all runs, or one for each
    mgl: float = 1.2
    friction: float | tuple[float, ...] = 0.06  # of all runs, or one for each
    creep: float = 0.05
    ripple: float = 0.0  # torque with twelve periods per turn, N m
    memory: tuple[float, float] = (0.0, 1.0)  # stiffness (N m/rad) of a spring, time (s) until it gives way
    supply: float | tuple[float, ...] = 1.0  # gain of the torque, of all runs or one for each
    dead_zone: float = 0.0  # of the torque, N m
    limit: float = np.inf  # of the torque, N m
    lag: float = 0.0  # behind which the torque acts, s; before a run there is none
    noise: float = 2e-4  # of the angle, rad
    gain: float = 1.0
    delay: int = 0  # of the sensor, in samples
    missed: float = 0.0  # angle that the sensor loses after a third of a run, rad
    groups: tuple[str, ...] = ()
    runs: int = 4
    samples: int = 500
    seed: int = 0

    def recorded(self, folder: Path, *changes: tuple[str, str]) -> tuple[System, Logs]:
        """The system with changes, which is written to `folder`, and the logs."""
        system = pendulum(folder, *changes)
        return system, self.logs(folder / "logs", system)

    def logs(self, folder: Path, system: System) -> Logs:
        """Written as a log folder and read back."""
        t, shown, u = _measured(self)
        tables = [
            {"t": t, "theta": angle, "torque": torque} for angle, torque in zip(shown.T, u.T, strict=True)
        ]
        return logs_of(system, folder, tables, **({"group": self.groups} if self.groups else {}))

    def rates(self, x: Array, u: Array) -> Array:
        """Time derivatives of angle, speed and, if there is one, memory (2 or 3, runs) at x and u (runs,)."""
        theta, omega, *memory = x
        stiffness, time = self.memory
        load = np.asarray(self.friction) * np.tanh(omega / self.creep) + self.ripple * np.sin(12 * theta)
        load = load + sum(stiffness * (theta - z) for z in memory)
        u = np.clip(u, -self.limit, self.limit)
        u = np.asarray(self.supply) * (u - np.clip(u, -self.dead_zone, self.dead_zone))
        rates = [omega, (u - np.asarray(self.b) * omega - self.mgl * np.sin(theta) - load) / 0.02]
        return np.stack([*rates, *((theta - z) / time for z in memory)])


@cache  # many tests log the same bench
def _measured(bench: Bench) -> tuple[Array, Array, Array]:
    """Time (samples,), angle and torque (samples, runs) as a bench logs them."""
    rng = np.random.default_rng(bench.seed)
    t = np.arange(bench.samples + bench.delay) * PERIOD
    phase, rate = rng.uniform(0.0, 6.0, bench.runs), np.linspace(3.0, 9.0, bench.runs)
    u = 0.7 * np.sin(rate * t[:, None] + phase) + 0.3 * np.sin(2.3 * rate * t[:, None])
    start = np.stack([rng.uniform(-0.8, 0.8, bench.runs), *np.zeros((2, bench.runs))])
    theta = motion(bench.rates, start, lagged(u, bench.lag), PERIOD)[:, 0]
    noise = bench.noise * rng.standard_normal((bench.samples, bench.runs))
    shown = bench.gain * theta[: bench.samples] + noise
    shown[bench.samples // 3 :] -= bench.missed
    return t[: bench.samples], shown, u[bench.delay :]


def lagged(u: Array, lag: float) -> Array:
    """Inputs (samples, runs), straight between samples, behind a lag that starts at zero."""
    found, last = np.zeros_like(u), np.zeros(u.shape[1])
    for k, (before, after) in enumerate(pairwise(u), start=1):
        behind = lag * (after - before) / PERIOD  # of a ramp, in the end
        last = after - behind + (last - before + behind) * np.exp(-PERIOD / lag) if lag else after
        found[k] = last
    return found if lag else u


def exact(system: System) -> System:
    """The system with the truth of `Bench`, where it has the parameters."""
    truth = Bench()
    known = {"b": truth.b, "mgl": truth.mgl, "F_c": truth.friction, "creep": truth.creep}
    return system.with_values({p.name: float(known.get(p.name, p.value)) for p in system.parameters})
