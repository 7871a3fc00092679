"""Free runs through the compiled kernel, as an operation that torch can differentiate."""

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
from unmodelled.logs.logs import Logs
from unmodelled.models.nnap import Nnap

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Measured:
    """Experiments one after the other, as kernels read them.

    Attributes:
        x: (samples, states) measured or estimated states. u: (samples, inputs). t: (samples,) s.
        c: (experiments, constants). owner: (samples,) the experiment of each sample.
        offsets: (experiments + 1,) experiment i owns offsets[i]:offsets[i + 1].
    """

    x: Array
    u: Array
    t: Array
    c: Array
    owner: Indices
    offsets: Indices

    @classmethod
    def of(cls, logs: Logs) -> Measured:
        """The samples of a log folder."""
        x, u, t, c = (np.array(a, np.float64, order="C") for a in (logs.x, logs.u, logs.t, logs.c))
        return cls(x, u, t, c, logs.owner, np.asarray(logs.offsets, np.int64))

    def window_starts(self, runs: Indices, horizon: int) -> Indices:
        """First samples of all windows of `horizon` steps that lie within one of the experiments `runs`."""
        parts = [np.arange(self.offsets[r], self.offsets[r + 1] - horizon) for r in runs]
        return np.concatenate(parts) if parts else np.empty(0, np.int64)


def arguments(how: Integration) -> tuple[int, float, float, Array]:
    """What the kernels' functions want to know about the integration, in their order."""
    return how.substeps, how.period, float(how.hold), how.stages


def _common(model: Nnap, member: int, how: Integration) -> tuple[Any, ...]:
    values = (model.physics(), model.weights, model.scale, model.gain)
    own = (np.ascontiguousarray(a[member].detach().double().cpu().numpy()) for a in values)
    return (*arguments(how), *own)


def generated(model: Nnap, member: int) -> Generated:
    """Return one member of a stack as a backend of `free_run` that shows all states.

    Args:
        model: stack of models.
        member: number of the member in the stack.
    """
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
        x0: states at the first samples, (windows, states), SI.
        starts: first samples, (windows,).
        steps: number of samples that follow the first one.
        how: method, step and course of the inputs between samples.

    Returns:
        Trajectories (windows, steps + 1, states) and efforts of the networks (windows, steps, networks), SI.

    Raises:
        ValueError: when a window leaves the data.
    """
    length, one = np.full(len(starts), steps), np.zeros(1, np.int64)
    windows = Windows(data.u, data.t, starts, length, data.owner[starts], one).checked()
    p = model.physics()[member].detach().double().cpu().numpy()
    return generated(model, member).trajectories(windows, 0, p, data.c, x0, steps, how)


class CompiledRollout(torch.autograd.Function):
    """`simulate` with analytic back-propagation through time to x0, the trained parameters and the
    weights.
    """

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
        """x0 (windows, states), xi (trained,), weights (size,) of `member`; see `simulate`."""
        X, Z = simulate(model, member, data, x0.detach().numpy(), starts, steps, how)
        # the weights of this moment: an optimiser may have moved on when backward is called
        ctx.context = model, data, starts, steps, X[:, :1].copy(), _common(model, member, how)
        return torch.from_numpy(X), torch.from_numpy(Z)

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor | None, ...]:
        """Gradients by x0, xi and weights."""
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
    """Differentiable `simulate`: trajectories (windows, steps + 1, states), efforts (windows, steps,
    networks).
    """
    result: tuple[Tensor, Tensor] = CompiledRollout.apply(  # type: ignore[no-untyped-call]
        x0, model.xi[member], model.weights[member], model, member, data, starts, steps, how
    )
    return result
