"""Initial parameters, weights and scales of a stack of hybrid models, one member at a time."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from unmodelled.base.arrays import Array, Indices
from unmodelled.engine.compiled.structure import Augmented
from unmodelled.learning.rollout import Measured
from unmodelled.systems.reference import torch_equations

#: Samples over which a measured slope is taken to estimate the size of the missing effort; one is too noisy.
LAG = 10
#: Number of samples that determine these scales well enough.
ENOUGH = 4000


def initial_parameters(
    structure: Augmented, spread: float, spread_of_fixed: float, rng: np.random.Generator
) -> Array:
    """Draw the parameters (parameters,), in SI units, from which the training of one model starts."""
    start = np.array(structure.system.values)
    for k, parameter in enumerate(structure.system.parameters):
        trained = parameter.name in structure.trainable
        relative = spread if trained else spread_of_fixed
        start[k] *= 1.0 + relative * rng.uniform(-1.0, 1.0)
        if trained:
            start[k] = np.clip(start[k], *parameter.limits)
    return start


def initial_weights(structure: Augmented, rng: np.random.Generator) -> Array:
    """Draw the weights (structure.size,) of the networks of one model: Glorot uniform.

    Hidden biases are uniform too, so that the kinks of the ReLU units do not all lie at zero.
    """
    parts = []
    for network in structure.networks:
        ni, nh = len(network.inputs), network.hidden
        inner, outer = np.sqrt(6.0 / (ni + nh)), np.sqrt(6.0 / (nh + 1))
        parts += [rng.uniform(-inner, inner, ni * nh), rng.uniform(-1.0, 1.0, nh)]
        parts += [rng.uniform(-outer, outer, nh), np.zeros(1)]
    return np.concatenate(parts) if parts else np.empty(0)


def scales(
    structure: Augmented, data: Measured, runs: list[Indices], p: Tensor, period: float
) -> tuple[Array, Array]:
    """Estimate the scales of the networks' inputs (members, inputs) and efforts (members, networks).

    The gain of a network is the size of the effort that the physics misses: least squares of the residual of
    the measured acceleration on the influence of the port, over the training data of the member.
    """
    scale = np.ones((len(runs), len(structure.inputs)))
    gain = np.ones((len(runs), len(structure.networks)))
    if not structure.networks:
        return scale, gain
    system = structure.system
    names = system.port_names
    f, q = torch_equations(system, system.closed), torch_equations(system, structure.inputs)
    for m, members in enumerate(runs):
        lag = LAG if len(data.window_starts(members, LAG)) else 1
        first = data.window_starts(members, lag)
        first = first[:: -(-len(first) // ENOUGH)]
        now = first + lag // 2
        x, u, t = (torch.from_numpy(a[now]) for a in (data.x, data.u, data.t))
        c = torch.from_numpy(data.c[data.owner[now]])
        e = torch.zeros(len(now), len(names), dtype=torch.float64, requires_grad=True)
        values = q(t, x, u, e, p[m], c).detach().numpy()
        deviation = values.std(axis=0)
        scale[m] = 1.0 / np.where(deviation > 0.0, deviation, 1.0)
        known = f(t, x, u, e, p[m], c)
        slope = (data.x[first + lag] - data.x[first]) / (lag * period)
        found = _missing(known, e, torch.from_numpy(slope))
        gain[m] = [found[names.index(n.port)] or 1.0 for n in structure.networks]
    return scale, gain


def _missing(known: Tensor, e: Tensor, slope: Tensor) -> Array:
    """Size of the effort that is missing in every port, (ports,)."""
    missing = slope - known.detach()
    size = missing.square().mean(0).sqrt().clamp(min=1e-30)
    influence = torch.stack(
        [
            torch.autograd.grad(known[:, i].sum(), e, retain_graph=True)[0] / size[i]
            for i in range(known.shape[1])
        ],
        1,
    )
    projected = torch.einsum("sie,si->se", influence, missing / size)
    power = influence.square().sum(1)
    found: Array = (projected.square().sum(0) / power.square().sum(0).clamp(min=1e-300)).sqrt().numpy()
    return found
