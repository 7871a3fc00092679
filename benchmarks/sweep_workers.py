"""A sweep with two workers against one after the other, and a model of what more workers bring."""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from benchmarks.timing import compared, seconds

PEER = "the same sweep with one worker"
ROOT = Path(__file__).parent.parent
RUNS, ROUNDS = 4, 3
SWEEP = [
    *("train", "-m", f"system={ROOT}/systems/pendulum.yaml", "logs=logs", "model=hybrid"),
    *("split=leave_one_out", "model.windows.epochs=20", "+model.windows.workers=1"),
]


def run() -> dict[str, float]:
    """Four trainings of a hybrid model of the pendulum, six folds each, a thread a worker.

    `predicted` is the time of two workers by the model T = start + ceil(runs / workers) * one_run, whose two
    numbers come from sweeps of one and of four runs with one worker. `threads_instead` is one worker that has
    both threads.
    """
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        _pipeline(folder, 1, "acquire", "source=pendulum", "out=logs")
        _sweep(folder, 1, 1, 1)  # compiles
        single, pairs = [], []
        for _ in range(ROUNDS):
            single.append(seconds(lambda: _sweep(folder, 1, 1, 1)))
            two = seconds(lambda: _sweep(folder, RUNS, 2, 1))
            pairs.append((two, seconds(lambda: _sweep(folder, RUNS, 1, 1))))
        threaded = seconds(lambda: _sweep(folder, RUNS, 1, 2))
    result, first = compared(pairs), statistics.median(single)
    one_run = (result["peer"] - first) / (RUNS - 1)
    model = {"start": first - one_run, "one_run": one_run, "predicted": first - one_run + RUNS / 2 * one_run}
    return {**result, **model, "threads_instead": threaded, "threads": 1}


def _sweep(folder: Path, runs: int, workers: int, threads: int) -> None:
    seeds = ",".join(str(seed) for seed in range(runs))
    folders = f"hydra.sweep.dir=outputs/{runs}_{workers}_{threads}"
    _pipeline(folder, threads, *SWEEP, f"seed={seeds}", f"hydra.launcher.n_jobs={workers}", folders)


def _pipeline(folder: Path, threads: int, *words: str) -> None:
    count = dict.fromkeys(("OMP_NUM_THREADS", "NUMBA_NUM_THREADS"), str(threads))
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "EXP_LAUNCHER": "joblib", **count}
    command = [sys.executable, "-m", "pipeline", *words]
    subprocess.run(command, cwd=folder, env=environment, check=True, capture_output=True)
