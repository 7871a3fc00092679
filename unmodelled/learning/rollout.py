"""Simulate free runs by the compiled kernel, as an operation that torch can differentiate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from unmodelled.engine.compiled import loops
from unmodelled.engine.compiled.backend import Generated
from unmodelled.engine.compiled.compiled import kernel
from unmodelled.engine.free_run import Integration, Windows
from unmodelled.learning.nnap import Nnap

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Measured:
    """Measured experiments as arrays, one experiment after the other, as kernels read them.

    Attributes:
        x: measured or estimated states, shape (samples, states), SI.
        u: inputs of the system, shape (samples, inputs), SI.
        t: time since the start of the experiment, shape (samples,), s.
        c: constants of the operating points, shape (experiments, constants), SI.
        owner: number of the experiment of every sample, shape (samples,).
        offsets: first samples of the experiments, and the number of all samples, shape (experiments + 1,).

    Examples:
        >>> t, owner, offsets = np.tile(np.arange(3.0), 2), np.repeat([0, 1], 3), np.array([0, 3, 6])
        >>> data = Measured(np.zeros((6, 1)), np.zeros((6, 1)), t, np.zeros((2, 0)), owner, offsets)
        >>> data.window_starts(np.array([0, 1]), horizon=1).tolist()
        [0, 1, 3, 4]
    """

    x: Array
    u: Array
    t: Array
    c: Array
    owner: Indices
    offsets: Indices

    def window_starts(self, runs: Indices, horizon: int) -> Indices:
        """Return the first samples of all windows that lie within one experiment.

        Takes runs (experiments,); gives (windows,).
        """
        parts = [np.arange(self.offsets[r], self.offsets[r + 1] - horizon) for r in runs]
        return np.concatenate(parts) if parts else np.empty(0, np.int64)


def arguments(how: Integration) -> tuple[int, float, float, Array]:
    """Return an integration as the arguments of the kernels' functions, in their order.

    Gives (stages, 3).
    """
    return how.substeps, how.period, how.common_hold, how.stages


def _common(model: Nnap, member: int, how: Integration) -> tuple[Any, ...]:
    values = (model.physics(), model.weights, model.scale, model.gain)
    own = (np.ascontiguousarray(a[member].detach().double().cpu().numpy()) for a in values)
    return (*arguments(how), *own)


def generated(model: Nnap, member: int) -> Generated:
    """Return one member of a stack as a backend of `free_run` that shows all states."""
    values = (model.weights, model.scale, model.gain)
    own = (np.ascontiguousarray(a[member].detach().double().cpu().numpy()) for a in values)
    return Generated(model.structure, tuple(model.structure.system.x), *own)


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
        """Simulate windows, see `simulate`.

        Takes x0 (windows, states) in SI, xi (trained,), weights (size,), starts (windows,); gives (windows,
        steps + 1, states) and (windows, steps, networks).
        """
        X, Z = simulate(model, member, data, x0.detach().numpy(), starts, steps, how)
        # the weights of this moment: an optimiser may have moved on when backward is called
        ctx.context = model, data, starts, steps, X[:, :1].copy(), _common(model, member, how)
        return torch.from_numpy(X), torch.from_numpy(Z)

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor | None, ...]:
        """Return the gradients by first states, scaled trained parameters and weights.

        Takes gradients (windows, steps + 1, states); gives (windows, states) and (trained,) and (size,).
        """
        model, data, starts, steps, first, common = ctx.context
        G, GZ = (np.ascontiguousarray(g.numpy()) for g in gradients)
        k = kernel(model.structure)
        inputs = data.u, data.c, data.t, steps
        gx0, gp, gW = loops.pullback(
            *(k.evaluate, k.pull, k.layout, first, G, GZ, starts, data.owner),
            *(*inputs, *common),
        )
        units = model.unit.detach().cpu()
        grown = torch.from_numpy(gx0[:, 0]), torch.from_numpy(gp) * units, torch.from_numpy(gW)
        return (*grown, None, None, None, None, None, None)


def rollout(
    model: Nnap, member: int, data: Measured, x0: Tensor, starts: Indices, steps: int, how: Integration
) -> tuple[Tensor, Tensor]:
    """Simulate windows by one member of a stack, differentiable by torch, see `simulate`.

    Takes x0 (windows, states) in SI, starts (windows,); gives (windows, steps + 1, states) and (windows,
    steps, networks).
    """
    result: tuple[Tensor, Tensor] = CompiledRollout.apply(  # type: ignore[no-untyped-call]
        x0, model.xi[member], model.weights[member], model, member, data, starts, steps, how
    )
    return result
