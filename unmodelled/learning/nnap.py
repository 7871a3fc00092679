"""Neural-network-augmented physics: a system with ReLU networks in its ports (chapter 4)."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property

import sympy as sp
import torch
from torch import Tensor, nn

from unmodelled.engine.compiled.structure import Augmented
from unmodelled.engine.free_run import Integration
from unmodelled.systems.reference import Equations, torch_equations
from unmodelled.systems.sticking import STEP_LENGTH, held


class Nnap(nn.Module):
    """A stack of models that share a structure and differ in weights and parameters, in double precision.

    A network's output is multiplied by its gain, the magnitude of the missing effort.
    """

    p: Tensor  # (batch, parameters), in SI units; training starts at the trained ones
    unit: Tensor  # (trained,), in SI units: xi = p / unit is of order one
    scale: Tensor  # (batch, inputs), 1 / standard deviation over the training data, eq. 4.4
    gain: Tensor  # (batch, networks), in the units of the efforts

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
    def _rates(self) -> dict[float, Equations]:
        """Rates by the length of the integration step, s."""
        return {}

    @cached_property
    def _inputs(self) -> Equations:
        return torch_equations(self.structure.system, self.structure.inputs)

    def physics(self) -> Tensor:
        """Return the parameters (batch, parameters) of the system, in SI units, differentiable by `xi`."""
        p = self.p.clone()
        if self.structure.index:
            p[:, list(self.structure.index)] = self.xi * self.unit
        return p

    def network_inputs(self, t: Tensor, x: Tensor, u: Tensor, c: Tensor) -> Tensor:
        """Return the inputs q (batch, samples, inputs) of all networks, in SI units.

        Takes t (samples,), x (batch, samples, states), u (..., inputs) and c (..., constants), in SI units.
        """
        system = self.structure.system
        none = x.new_zeros(len(system.ports))
        if not self.structure.inputs:
            return x.new_zeros((*x.shape[:-1], 0))
        return self._inputs(t, x, u, none, self.physics()[:, None], c)

    def efforts(self, t: Tensor, x: Tensor, u: Tensor, c: Tensor) -> Tensor:
        """Return the effort (batch, samples, networks) of every network, eq. 4.4, see `network_inputs`."""
        return self.efforts_of(self.network_inputs(t, x, u, c))

    def efforts_of(self, q: Tensor) -> Tensor:
        """Return the efforts (batch, samples, networks) at network inputs (batch, samples, inputs)."""
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

    def derivative(
        self, t: Tensor, x: Tensor, u: Tensor, c: Tensor, step: float = 0.0
    ) -> tuple[Tensor, Tensor]:
        """Return the rates (batch, samples, states), eq. 4.5, and the efforts, see `network_inputs`.

        Rates are those of an integration with some step, s, see `held`.
        """
        z = self.efforts(t, x, u, c)
        names = self.structure.system.port_names
        e = x.new_zeros((*x.shape[:-1], len(names)))
        for k, network in enumerate(self.structure.networks):
            e[..., names.index(network.port)] = e[..., names.index(network.port)] + z[..., k]
        if step not in self._rates:
            rates = held(self.structure.system.x, self.structure.system.closed)
            self._rates[step] = torch_equations(
                self.structure.system, [f.xreplace({STEP_LENGTH: sp.Float(step)}) for f in rates]
            )
        return self._rates[step](t, x, u, e, self.physics()[:, None], c), z

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
                    dx, z = self.derivative(t, x + part * float(before) * dx, now + share * slope, c, part)
                    growth = growth + float(weight) * dx
                    if sub == 0 and time == 0.0 and len(zs) == k:
                        zs.append(z)
                x = x + part * growth
            xs.append(x)
        return torch.stack(xs, -2), torch.stack(zs, -2)
