"""Free runs of a structure that was never seen before: the register machine against a generated kernel."""

from __future__ import annotations

import statistics
from collections.abc import Callable
from dataclasses import replace

import numba
import numpy as np
import pandas as pd
import sympy as sp
import torch

from benchmarks.slider_crank import PERIOD, SYSTEM
from benchmarks.timing import seconds, side_by_side
from unmodelled.base.arrays import Array
from unmodelled.base.threads import one_thread
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.fitting.fit import begin, iterate
from unmodelled.diagnosis.fitting.simulation import Simulation
from unmodelled.diagnosis.fitting.unknowns import Unknown, Unknowns
from unmodelled.engine.compiled.compiled import kernel
from unmodelled.engine.compiled.structure import Augmented
from unmodelled.engine.free_run import Integration, Windows, free_run
from unmodelled.engine.machine.program import Equations, assembled
from unmodelled.learning.held_out import measured_samples
from unmodelled.learning.nnap import Nnap
from unmodelled.learning.rollout import simulate
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import Parameter, System, symbol
from unmodelled.systems.reader import read_system

PEER = f"the kernel generated for this structure and compiled before, numba {numba.__version__}"
RK4 = Integration(PERIOD, "rk4", 1, 1.0)
EXPERIMENTS, SAMPLES, HORIZON, ROUNDS = 14, 2000, 0.1, 5
FITTED = ("m1", "m2", "m3", "l1", "J1", "B_m", "F_c", "F_b", "v_s", "k_s")


def run() -> dict[str, float]:
    """Slider-crank with friction and a spring, 14 runs of 2000 samples in windows of 0.1 s, RK4, one thread.

    The ratio is that of the free runs alone, thirteen for every window. `iteration` is one of a fit of ten
    parameters and all states at the starts, `new_structure` the time from a system to its first simulated
    window, `new_kernel` that to its kernel.
    """
    system = candidate("F_c", "F_b", "v_s", "k_s")
    with one_thread():
        logs = measured(system)
        simulation = Simulation(system, Recording.of(logs, HORIZON))
        numbers = {p.name: p for p in system.parameters}
        unknowns = Unknowns(simulation, tuple(Unknown.of(numbers[name]) for name in FITTED))
        start = unknowns.vector({name: 0.9 * numbers[name].value for name in FITTED})
        descents = begin(unknowns, [start], substeps=1)
        iterations = [seconds(lambda: iterate(descents)) for _ in range(ROUNDS)]
        fresh = [candidate(f"F{k}", "F_b", "v_s", "k_s") for k in range(ROUNDS)]
        for other in (system, *fresh):
            other.closed  # noqa: B018 - kept by the system, whoever asks first
        structures = [seconds(lambda other=other: first_window(other)) for other in fresh]
        compiling = seconds(lambda: kernel(Augmented(fresh[0])))
        result = side_by_side(*free_runs(system, simulation), rounds=ROUNDS)
    return {
        **result,
        "iteration": statistics.median(iterations),
        "new_structure": statistics.median(structures),
        "new_kernel": compiling,
        "threads": 1,
    }


def candidate(coulomb: str, breakaway: str, stribeck: str, stiffness: str) -> System:
    """The slider-crank with a law at its slider; the names of its numbers."""
    known = read_system(SYSTEM)
    v, d = known.expression("v"), known.expression("d")
    c, b, s, k = (symbol(name) for name in (coulomb, breakaway, stribeck, stiffness))
    law = (c + b * sp.exp(-((v / s) ** 2))) * sp.tanh(v / 0.01) + k * d
    values = {coulomb: 3.0, breakaway: 1.5, stribeck: 0.03, stiffness: 60.0}
    more = tuple(Parameter(name, "1", value, True, (0.0, 10.0 * value)) for name, value in values.items())
    ports = (replace(known.ports[0], law=law),)
    return replace(known, ports=ports, parameters=(*known.parameters, *more))


def measured(system: System) -> Logs:
    """Noisy logs of the system itself."""
    rng = np.random.default_rng(0)
    t = np.arange(SAMPLES) * PERIOD
    rate, phase = rng.uniform(10.0, 45.0, (2, EXPERIMENTS, 1)), rng.uniform(0.0, 6.0, (2, EXPERIMENTS, 1))
    u = (3.3 * np.sin(rate[0] * t + phase[0]) + 2.5 * np.sin(rate[1] * t + phase[1])).reshape(-1, 1)
    owner = np.arange(EXPERIMENTS)
    clock, offsets = np.tile(t, EXPERIMENTS), SAMPLES * np.arange(EXPERIMENTS + 1)
    windows = Windows(u, clock, offsets[:-1], np.full(EXPERIMENTS, SAMPLES - 1), owner, np.zeros(1, np.int64))
    p = np.tile(system.values, (EXPERIMENTS, 1, 1))
    x0 = rng.uniform(0.0, 3.0, (EXPERIMENTS, 1, 1)) * [1.0, 0.0]
    program = assembled(Equations.of(system, system.x))
    constants, how = np.empty((EXPERIMENTS, 0)), Integration(PERIOD, "rk4", 2, 1.0)
    x = free_run(program, windows, p, constants, x0, how).reshape(-1, 2)
    y = x + [2e-4, 0.1] * rng.standard_normal(x.shape)
    ids = tuple(f"run{k}" for k in owner)
    table = pd.DataFrame({"id": ids})
    names = ("theta", "omega"), ("T",), ("theta", "omega"), ()
    return Logs(*names, ids, table, PERIOD, offsets, clock, y, u, constants, y, (True, True), (), {})


def first_window(system: System) -> Array:
    """One window of a system that the machine has not seen."""
    program, nothing = assembled(Equations.of(system, system.x)), np.zeros(1, np.int64)
    windows = Windows(np.zeros((201, 1)), np.zeros(201), nothing, nothing + 200, nothing, nothing)
    values = np.array(system.values)[None, None]
    return free_run(program, windows, values, np.empty((1, 0)), np.zeros((1, 1, 2)), RK4)


def free_runs(system: System, simulation: Simulation) -> tuple[Callable[[], Array], Callable[[], Array]]:
    """Calls of both that simulate every window thirteen times, after a check that they find the same."""
    recording, sets = simulation.recording, 1 + len(FITTED) + 2
    logs, whole = recording.logs, recording.steps == recording.steps.max()
    starts, steps = recording.start[whole], int(recording.steps.max())
    x0 = np.repeat(logs.y[starts][:, None], sets, axis=1)
    p, c = np.tile(system.values, (EXPERIMENTS, sets, 1)), np.empty((EXPERIMENTS, 0))
    windows = Windows(
        logs.u, logs.t, starts, np.full(len(starts), steps), logs.owner[starts], np.zeros(sets, np.int64)
    )
    program = assembled(Equations.of(system, system.x))
    none = torch.empty((1, 0), dtype=torch.float64)
    values = torch.tensor([system.values], dtype=torch.float64)
    model = Nnap(Augmented(system), values, none[0], none, none, none)
    data = measured_samples(logs)

    def ours() -> Array:
        return free_run(program, windows, p, c, x0, RK4)

    def peer() -> Array:
        x, _ = simulate(model, 0, data, x0.reshape(-1, 2), np.repeat(starts, sets), steps, RK4)
        return x.reshape(len(starts), sets, steps + 1, 2)

    error = float(np.abs(ours() - peer()).max())
    if not error < 1e-8:
        raise ArithmeticError(f"the kernel's trajectories differ from the machine's by {error:.1e}")
    return ours, peer
