"""Free runs of hybrid models along held-out experiments, and the efforts that their networks learned."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import pandas as pd
import torch

from unmodelled.base.arrays import Array, Indices
from unmodelled.base.progress import track
from unmodelled.engine.free_run import Integration
from unmodelled.learning.nnap import Nnap
from unmodelled.learning.rollout import Measured, simulate
from unmodelled.logs.logs import Logs

#: A simulated state this many times larger than any measured one counts as diverged, and is held there.
LARGEST = 10.0
#: Number of points of a surface along each input.
GRID = 41


def measured_samples(logs: Logs) -> Measured:
    """Return the samples of logs as kernels read them."""
    x, u, t, c = (np.array(a, np.float64, order="C") for a in (logs.x, logs.u, logs.t, logs.c))
    return Measured(x, u, t, c, logs.owner, np.asarray(logs.offsets, np.int64))


class FreeRuns(NamedTuple):
    """Free runs of a stack of models: two tables of `Evaluation`."""

    errors: pd.DataFrame
    examples: pd.DataFrame


def free_runs(
    model: Nnap, logs: Logs, tests: Mapping[str, Indices], repeats: int, how: Integration
) -> FreeRuns:
    """Simulate the test experiments (k,) of every fold, whole, from their first measured state."""
    data = measured_samples(logs)
    limit = LARGEST * np.abs(logs.x).max(axis=0)
    shown = [j for j, measured in enumerate(logs.measured) if measured]
    errors, examples = [], []
    stack = [(fold, r) for fold in tests for r in range(repeats)]
    for member, (fold, repeat) in enumerate(track(stack, len(stack), "simulating")):
        for run in tests[fold].tolist():
            rows = logs.rows(run)
            X, diverged = _free_run(model, member, data, rows, limit, how)
            for j in shown:
                rmse = float(np.sqrt(np.mean((X[:, j] - logs.x[rows, j]) ** 2)))
                errors.append((fold, repeat, logs.ids[run], logs.states[j], rmse, diverged))
            if repeat == 0:
                columns = {f"{logs.states[j]}_measured": logs.x[rows, j] for j in shown}
                columns |= {logs.states[j]: X[:, j] for j in shown}
                head = {"fold": fold, "id": logs.ids[run], "t": logs.t[rows]}
                examples.append(pd.DataFrame({**head, **columns}))
    table = pd.DataFrame(errors, columns=["fold", "repeat", "id", "state", "rmse", "diverged"])
    return FreeRuns(table, pd.concat(examples, ignore_index=True))


def _free_run(
    model: Nnap, member: int, data: Measured, rows: slice, limit: Array, how: Integration
) -> tuple[Array, bool]:
    """One experiment: (samples, states), and whether it diverged."""
    steps = rows.stop - rows.start - 1
    start = np.array([rows.start])
    X = simulate(model, member, data, data.x[start], start, steps, how)[0][0]
    diverged = bool(np.any(~np.isfinite(X) | (np.abs(X) > limit)))
    return np.clip(np.nan_to_num(X, nan=np.inf, posinf=np.inf, neginf=-np.inf), -limit, limit), diverged


@torch.no_grad()
def surfaces(models: dict[str, Nnap], logs: Logs) -> pd.DataFrame:
    """Evaluate networks with two inputs on a grid over the range of the data, by the first of a stack."""
    parts = []
    for stage, model in models.items():
        q = _network_inputs(model, logs)[0]
        column = 0
        for k, network in enumerate(model.structure.networks):
            own = slice(column, column + len(network.inputs))
            column = own.stop
            if len(network.inputs) != 2:
                continue
            low, high = q[:, own].min(0).values, q[:, own].max(0).values
            axes = [torch.linspace(float(a), float(b), GRID).double() for a, b in zip(low, high, strict=True)]
            grid = torch.cartesian_prod(*axes)
            everything = q.new_zeros((model.batch, len(grid), q.shape[1]))
            everything[..., own] = grid
            effort = model.efforts_of(everything)[0, :, k].numpy()
            columns = {"q0": grid[:, 0].numpy(), "q1": grid[:, 1].numpy(), "effort": effort}
            parts.append(pd.DataFrame({"stage": stage, "network": network.label or network.port, **columns}))
    empty = pd.DataFrame(columns=["stage", "network", "q0", "q1", "effort"])
    return pd.concat(parts, ignore_index=True) if parts else empty


def _network_inputs(model: Nnap, logs: Logs) -> torch.Tensor:
    """q of every model of the stack at the measured states, (batch, samples, inputs)."""
    x, u, t = (torch.from_numpy(np.array(a)) for a in (logs.x, logs.u, logs.t))
    c = torch.from_numpy(np.array(logs.c[logs.owner]))
    return model.network_inputs(t, x.expand(model.batch, -1, -1), u, c)


@torch.no_grad()
def learned_efforts(model: Nnap, logs: Logs, trained: Mapping[str, Indices], repeats: int) -> pd.DataFrame:
    """Evaluate the networks' efforts at the measured states of their training experiments (k,)."""
    names = [network.label or network.port for network in model.structure.networks]
    z = model.efforts_of(_network_inputs(model, logs)).numpy()
    seen = np.stack([np.isin(logs.owner, rows) for rows in trained.values() for _ in range(repeats)])
    count = seen.sum(axis=0)
    mean = np.where(seen[..., None], z, 0.0).sum(axis=0) / np.maximum(count, 1)[:, None]
    table = pd.DataFrame({"id": np.array(logs.ids, object)[logs.owner], "t": logs.t})
    return table.assign(**{name: mean[:, k] for k, name in enumerate(names)})[count > 0]
