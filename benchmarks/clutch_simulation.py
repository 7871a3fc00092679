"""Shifting times of the wet clutch by the compiled cascade against vectorised numpy, in processor time."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks.timing import compared, seconds
from pipeline.chapters import phases
from pipeline.rigs.clutch import ClutchCampaign
from unmodelled.base.arrays import Array
from unmodelled.engine.cascade.event_times import EventTimes
from unmodelled.systems.experiments import Experiments
from unmodelled.systems.model import System
from unmodelled.systems.reader import read_system

SYSTEM = Path(__file__).parent.parent / "systems" / "clutch.yaml"
PEER = f"numpy {np.__version__}, all samples and operating points in one array"
UNCERTAIN = ("p_hc0", "z_p")
PERIOD, DURATION, STEP = 0.001, 4.0, 0.004
SAMPLES, PEERS, MANY = 8192, 64, 200_000


def run() -> dict[str, float]:
    """108 operating points, Runge-Kutta steps of 4 ms up to the shift, two threads; per simulation.

    microseconds: ours. seconds_200000: wall-clock time of as many samples at all operating points, from the
    8192 that were simulated. step_error: largest difference to steps of 1 ms, s, and its median.
    """
    system, runs = read_system(SYSTEM), engagements()
    model = _event_times(system, runs, STEP)
    theta = _samples(SAMPLES)
    expected = phases.event_times(system, "shift", UNCERTAIN, theta[:PEERS], runs, STEP)
    if not np.nanmedian(np.abs(model(theta[:PEERS]) - expected)) < 1e-4:
        raise ArithmeticError("the peer's shifting times are others")

    def peer() -> Array:
        return phases.event_times(system, "shift", UNCERTAIN, theta[:PEERS], runs, STEP)

    each = len(runs) * SAMPLES, len(runs) * PEERS
    pairs = [(_cpu(lambda: model(theta)) / each[0], _cpu(peer) / each[1]) for _ in range(3)]
    result = compared(pairs)
    error = np.abs(model(theta) - _event_times(system, runs, PERIOD)(theta))
    return {
        **result,
        "microseconds": 1e6 * result["ours"],
        "seconds_200000": seconds(lambda: model(theta)) * MANY / SAMPLES,
        "step_error": float(error.max()),
        "step_error_median": float(np.median(error)),
        "threads": model.threads,
    }


def engagements() -> Experiments:
    """The full factorial of section 3.3.1: 18 current profiles, three motor speeds, two brakes."""
    campaign = ClutchCampaign()
    table, t = campaign.table(), np.arange(round(DURATION / PERIOD) + 1) * PERIOD
    profiles = table[["u1", "u2", "u3"]].to_numpy()
    u = np.round([campaign.profiles.current(t, *row) for row in profiles], 5)[:, :, None]
    c = table[["omega_m", "T_b0"]].to_numpy(float)
    x0 = np.zeros((len(table), 5))
    x0[:, 0], x0[:, 3] = 2e4, 0.999 * c[:, 0]
    return Experiments(u, PERIOD, c, x0)


def _event_times(system: System, runs: Experiments, step: float) -> EventTimes:
    return EventTimes.of(system, "shift", UNCERTAIN, runs.u, PERIOD, runs.c, runs.x0, step, threads=2)


def _samples(n: int) -> Array:
    """From the distribution that the dissertation identified, within its box."""
    draws = np.random.default_rng(0).normal([0.91, 0.55], [0.081, 0.046], (n, 2))
    return np.clip(draws, [0.7, 0.4], [1.3, 1.15])


def _cpu(work: Callable[[], object]) -> float:
    """Seconds of all processors together."""
    start = time.process_time()
    work()
    return time.process_time() - start
