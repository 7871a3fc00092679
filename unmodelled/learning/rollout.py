"""Simulate free runs by the compiled kernel, as an operation that torch can differentiate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor

from unmodelled.base.arrays import Array, Indices
from unmodelled.engine.compiled import rollouts
from unmodelled.engine.compiled.backend import Generated
from unmodelled.engine.compiled.compiled import kernel
from unmodelled.engine.free_run import Integration, Windows
from unmodelled.learning.nnap import Nnap


@dataclass(frozen=True)
class Measured:
    """Measured experiments as arrays in SI units, one experiment after the other, as kernels read them."""

    x: Array  # (samples, states), measured or estimated
    u: Array  # (samples, inputs)
    t: Array  # (samples,), since the start of the experiment, s
    c: Array  # (experiments, constants)
    owner: Indices  # (samples,), number of the experiment
    offsets: Indices  # (experiments + 1,), first samples, and the number of all samples

    def window_starts(self, runs: Indices, horizon: int) -> Indices:
        """Return the first samples (windows,) of all windows that lie within one of the experiments (k,)."""
        parts = [np.arange(self.offsets[r], self.offsets[r + 1] - horizon) for r in runs]
        return np.concatenate(parts) if parts else np.empty(0, np.int64)


def arguments(how: Integration) -> tuple[int, float, float, Array]:
    """Return an integration as the arguments of the kernels' functions, the stages (stages, 3) last."""
    return how.substeps, how.period, how.common_hold, how.stages


def _numbers(model: Nnap, member: int) -> tuple[Array, ...]:
    """Parameters (parameters,), weights (size,), scale (inputs,) and gain (networks,) of one member."""
    values = (model.physics(), model.weights, model.scale, model.gain)
    return tuple(np.ascontiguousarray(a[member].detach().double().cpu().numpy()) for a in values)


def generated(model: Nnap, member: int) -> Generated:
    """Return one member of a stack as a backend of `free_run` that shows all states."""
    _, weights, scale, gain = _numbers(model, member)
    return Generated(model.structure, tuple(model.structure.system.x), weights, scale, gain)


def simulate(
    model: Nnap, member: int, data: Measured, x0: Array, starts: Indices, steps: int, how: Integration
) -> tuple[Array, Array]:
    """Simulate windows of one length by one member of a stack.

    Args:
        model: stack of models.
        member: number of the member in the stack.
        data: measured experiments, whose inputs drive the model.
        x0: states at the first samples, shape (windows, states), SI.
        starts: first samples, shape (windows,).
        steps: number of samples that follow the first one.
        how: method, step and course of the inputs between samples.

    Returns:
        Trajectories, SI, shape (windows, steps + 1, states), and efforts of the networks, SI, shape (windows,
        steps, networks).

    Raises:
        ValueError: when a window leaves the data.
    """
    length, one = np.full(len(starts), steps), np.zeros(1, np.int64)
    windows = Windows(data.u, data.t, starts, length, data.owner[starts], one).checked()
    p = model.physics()[member].detach().double().cpu().numpy()
    return generated(model, member).trajectories(windows, 0, p, data.c, x0, steps, how)


class CompiledRollout(torch.autograd.Function):
    """Windows simulated with analytic back-propagation to first states, parameters and weights."""

    @staticmethod
    def forward(
        ctx: Any,
        x0: Tensor,
        xi: Tensor,
        weights: Tensor,
        model: Nnap,
        member: int,
        data: Measured,
        starts: Indices,
        steps: int,
        how: Integration,
    ) -> tuple[Tensor, Tensor]:
        """Simulate windows from states x0 (windows, states), see `simulate`."""
        X, Z = simulate(model, member, data, x0.detach().numpy(), starts, steps, how)
        # the weights of this moment: an optimiser may have moved on when backward is called
        ctx.context = model, data, starts, steps, X[:, :1].copy(), (*arguments(how), *_numbers(model, member))
        return torch.from_numpy(X), torch.from_numpy(Z)

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor | None, ...]:
        """Return the gradients by first states (windows, states), xi (trained,) and weights (size,)."""
        model, data, starts, steps, first, common = ctx.context
        G, GZ = (np.ascontiguousarray(g.numpy()) for g in gradients)
        k = kernel(model.structure)
        inputs = data.u, data.c, data.t, steps
        gx0, gp, gW = rollouts.pullback(
            *(k.evaluate, k.pull, k.layout, first, G, GZ, starts, data.owner),
            *(*inputs, *common),
        )
        units = model.unit.detach().cpu()
        grown = torch.from_numpy(gx0[:, 0]), torch.from_numpy(gp) * units, torch.from_numpy(gW)
        return (*grown, None, None, None, None, None, None)


def rollout(
    model: Nnap, member: int, data: Measured, x0: Tensor, starts: Indices, steps: int, how: Integration
) -> tuple[Tensor, Tensor]:
    """Simulate windows from states x0 (windows, states), differentiable by torch, see `simulate`."""
    result: tuple[Tensor, Tensor] = CompiledRollout.apply(  # type: ignore[no-untyped-call]
        x0, model.xi[member], model.weights[member], model, member, data, starts, steps, how
    )
    return result
