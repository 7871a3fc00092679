"""Neural-network-augmented physics: a system with ReLU networks in its ports (chapter 4)."""

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
    """A stack of models that share a structure and differ in weights and parameters, in double precision.

    Args:
        structure: physics, networks and trained parameters.
        p: parameters of the system, shape (batch, parameters), SI; training starts at the trained ones.
        unit: scale of every trained parameter, shape (trained,), SI: xi = p / unit is of order one.
        scale: 1 / standard deviation of the networks' inputs over the training data, eq. 4.4, shape (batch,
            inputs).
        gain: magnitude of the missing effort, by which a network's output is multiplied, shape (batch,
            networks), in the unit of the effort.
        weights: initial weights of all networks, shape (batch, structure.size).

    Examples:
        >>> from unmodelled.learning.structures import one_per_port
        >>> from unmodelled.systems.reader import read_system
        >>> structure = one_per_port(2)(read_system("systems/pendulum.yaml"), ("b",)).structure
        >>> p, one = torch.tensor([[0.02, 0.01, 1.2]]), torch.ones
        >>> model = Nnap(structure, p, one(1), one(1, 2), one(1, 1), one(1, structure.size))
        >>> none = torch.zeros(1, 1)
        >>> model.efforts(torch.zeros(1), torch.zeros(1, 1, 2), none, torch.zeros(1, 0)).tolist()
        [[[3.0]]]
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
        """Return the parameters of the system, differentiable by `xi`.

        Gives (batch, parameters) in SI.
        """
        p = self.p.clone()
        if self.structure.index:
            p[:, list(self.structure.index)] = self.xi * self.unit
        return p

    def network_inputs(self, t: Tensor, x: Tensor, u: Tensor, c: Tensor) -> Tensor:
        """Return the inputs q of all networks.

        Takes t (samples,) in s, x (batch, samples, states) in SI, u (..., inputs) in SI, c (..., constants)
        in SI; gives (batch, samples, inputs) in SI.
        """
        system = self.structure.system
        none = x.new_zeros(len(system.ports))
        if not self.structure.inputs:
            return x.new_zeros((*x.shape[:-1], 0))
        function = self._equations[1]
        return function(t, x, u, none, self.physics()[:, None], c)  # type: ignore[no-any-return, operator]

    def efforts(self, t: Tensor, x: Tensor, u: Tensor, c: Tensor) -> Tensor:
        """Return the effort of every network, eq. 4.4.

        Takes t (samples,) in s, x (batch, samples, states) in SI, u (..., inputs) in SI, c (..., constants)
        in SI; gives (batch, samples, networks) in SI.
        """
        return self.efforts_of(self.network_inputs(t, x, u, c))

    def efforts_of(self, q: Tensor) -> Tensor:
        """Return the effort of every network for given network inputs, eq. 4.4.

        Takes q (batch, samples, inputs) in SI; gives (batch, samples, networks) in SI.
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
        """Return the time derivatives of the states, eq. 4.5, and the efforts of the networks.

        Takes t (samples,) in s, x (batch, samples, states) in SI, u (..., inputs) in SI, c (..., constants)
        in SI; gives (batch, samples, states) and (batch, samples, networks).
        """
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
        """Simulate every window by every model with torch, eq. 4.8: the reference of the compiled kernels.

        Args:
            x0: first states, shape (batch, windows, states), SI.
            u: inputs of the system, shape (batch, windows, steps + 1, inputs), SI.
            t0: time of the first samples, shape (windows,), s.
            c: constants of the operating points, shape (batch, windows, constants), SI.
            how: integration of the free runs.

        Returns:
            Trajectories, shape (batch, windows, steps + 1, states), SI, and efforts of the networks at all
            samples but the last, shape (batch, windows, steps, networks), SI.
        """
        x, xs = x0, [x0]
        zs: list[Tensor] = []
        part = how.period / how.substeps
        for k in range(u.shape[-2] - 1):
            now, slope = u[..., k, :], how.common_hold * (u[..., k + 1, :] - u[..., k, :])
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
