"""Neural network augmented physics: a system with ReLU networks in its ports (chapter 4)."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from unmodelled.engine.compiled.structure import Augmented
from unmodelled.engine.free_run import Integration
from unmodelled.systems.reference import torch_equations

Array = NDArray[np.float64]


class Nnap(nn.Module):
    """A stack of `batch` models that share a structure; each has its own weights and parameters. float64.

    Args:
        structure: physics, networks, trained parameters.
        p: (batch, parameters) all parameters, SI; the trained ones are where training starts.
        unit: (trained,) scale of each trained parameter: xi = p / unit is of order one.
        scale: (batch, inputs of all networks) 1 / standard deviation over the training data, eq. 4.4.
        gain: (batch, networks) magnitude of the effort that is missing, the unit of a network's output.
        weights: (batch, structure.size) initial weights.
    """

    p: Tensor
    unit: Tensor
    scale: Tensor
    gain: Tensor

    def __init__(
        self, structure: Augmented, p: Tensor, unit: Tensor, scale: Tensor, gain: Tensor, weights: Tensor
    ) -> None:
        super().__init__()
        self.structure = structure
        self.batch = len(p)
        for name, value in {"p": p, "unit": unit, "scale": scale, "gain": gain}.items():
            self.register_buffer(name, value.double())
        self.weights = nn.Parameter(weights.double())
        self.xi = nn.Parameter(self.p[:, list(structure.index)] / self.unit)

    @cached_property
    def _equations(self) -> tuple[object, object]:
        system = self.structure.system
        return torch_equations(system, system.closed), torch_equations(system, self.structure.inputs)

    def physics(self) -> Tensor:
        """(batch, parameters) all parameters, SI, differentiable by `xi`."""
        p = self.p.clone()
        if self.structure.index:
            p[:, list(self.structure.index)] = self.xi * self.unit
        return p

    def network_inputs(self, t: Tensor, x: Tensor, u: Tensor, c: Tensor) -> Tensor:
        """q of all networks, (batch, ..., inputs)."""
        system = self.structure.system
        none = x.new_zeros(len(system.ports))
        if not self.structure.inputs:
            return x.new_zeros((*x.shape[:-1], 0))
        function = self._equations[1]
        return function(t, x, u, none, self.physics()[:, None], c)  # type: ignore[no-any-return, operator]

    def efforts(self, t: Tensor, x: Tensor, u: Tensor, c: Tensor) -> Tensor:
        """Effort of every network, (batch, samples, networks), eq. 4.4.

        Args:
            t: (samples,) or (batch, samples) s. x: (batch, samples, states). u: (..., inputs). c: (...,
                constants).
        """
        return self.efforts_of(self.network_inputs(t, x, u, c))

    def efforts_of(self, q: Tensor) -> Tensor:
        """Effort of every network, (batch, samples, networks), from the inputs of all (batch, samples,
        inputs).
        """
        scaled = q * self.scale[:, None]
        parts = []
        for k, (W_h, b_h, W_o, b_o, columns) in enumerate(self._layers()):
            hidden = torch.relu(scaled[..., columns] @ W_h + b_h)
            parts.append(self.gain[:, None, k] * ((hidden @ W_o)[..., 0] + b_o))
        return torch.stack(parts, -1) if parts else q.new_zeros((*q.shape[:-1], 0))

    def _layers(self) -> Iterator[tuple[Tensor, Tensor, Tensor, Tensor, slice]]:
        weight = column = 0
        for network in self.structure.networks:
            ni, nh = len(network.inputs), network.hidden
            W = self.weights[:, weight : weight + network.size]
            W_h, b_h, W_o, b_o = torch.split(W, [ni * nh, nh, nh, 1], 1)
            yield W_h.view(-1, ni, nh), b_h[:, None], W_o[..., None], b_o, slice(column, column + ni)
            weight, column = weight + network.size, column + ni

    def derivative(self, t: Tensor, x: Tensor, u: Tensor, c: Tensor) -> tuple[Tensor, Tensor]:
        """x' (batch, samples, states), eq. 4.5, and the networks' efforts (batch, samples, networks)."""
        z = self.efforts(t, x, u, c)
        names = self.structure.system.port_names
        e = x.new_zeros((*x.shape[:-1], len(names)))
        for k, network in enumerate(self.structure.networks):
            e[..., names.index(network.port)] = e[..., names.index(network.port)] + z[..., k]
        function = self._equations[0]
        return function(t, x, u, e, self.physics()[:, None], c), z  # type: ignore[operator]

    def simulate(
        self, x0: Tensor, u: Tensor, t0: Tensor, c: Tensor, how: Integration
    ) -> tuple[Tensor, Tensor]:
        """Free run of every model over every window, eq. 4.8: the torch reference.

        Args:
            x0: (batch, windows, states). u: (batch, windows, steps + 1, inputs). t0: (windows,) s.
            c: (batch, windows, constants).

        Returns:
            Trajectory (batch, windows, steps + 1, states); networks' efforts at its samples but the last
            (batch, windows, steps, networks).
        """
        x, xs = x0, [x0]
        zs: list[Tensor] = []
        part = how.period / how.substeps
        for k in range(u.shape[-2] - 1):
            now, slope = u[..., k, :], how.hold * (u[..., k + 1, :] - u[..., k, :])
            for sub in range(how.substeps):
                growth: Tensor | float = 0.0
                dx = torch.zeros_like(x)
                for before, weight, time in how.stages:
                    share = (sub + float(time)) / how.substeps
                    t = t0 + (k + share) * how.period
                    dx, z = self.derivative(t, x + part * float(before) * dx, now + share * slope, c)
                    growth = growth + float(weight) * dx
                    if sub == 0 and time == 0.0 and len(zs) == k:
                        zs.append(z)
                x = x + part * growth
            xs.append(x)
        return torch.stack(xs, -2), torch.stack(zs, -2)
