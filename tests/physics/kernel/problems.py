"""Free runs of kernels next to those of the torch reference."""

from dataclasses import dataclass, replace

import numpy as np
import sympy as sp
import torch
from torch import Tensor

from tests.machines.known import EMPTY, Array
from unmodelled.base.arrays import Indices
from unmodelled.engine.compiled.structure import Augmented
from unmodelled.engine.free_run import Integration
from unmodelled.learning.nnap import Nnap
from unmodelled.learning.rollout import Measured, rollout
from unmodelled.learning.structures import physics_only
from unmodelled.systems.model import Parameter, Port, State, System, symbol

Results = dict[str, Tensor]
#: Euler and RK4, both holds, one to three substeps.
INTEGRATIONS = (
    Integration(2e-4, "euler"),
    Integration(2e-4, "euler", substeps=3, hold=1.0),
    Integration(2e-4, "rk4", substeps=2),
    Integration(2e-4, "rk4", hold=1.0),
)


@dataclass(frozen=True)
class Problem:
    """A stack of models, three experiments of different length, and windows anywhere in them."""

    model: Nnap
    data: Measured
    x0: Array
    starts: Indices
    steps: int


def problem(
    structure: Augmented, windows: int = 21, steps: int = 4, period: float = 2e-4, seed: int = 0
) -> Problem:
    """Random states, inputs, weights and efforts of order one; another constant for every experiment."""
    generator = np.random.default_rng(seed)
    draw, system = generator.normal, structure.system
    lengths = [steps + 3, 2 * steps + 1, steps + 9]
    offsets = np.concatenate([[0], np.cumsum(lengths)])
    n, first = int(offsets[-1]), (0.0, 3.0, 0.7)
    data = Measured(
        x=draw(size=(n, len(system.states))),
        u=draw(size=(n, len(system.inputs))),
        t=np.concatenate([start + period * np.arange(k) for start, k in zip(first, lengths, strict=True)]),
        c=generator.uniform(0.3, 1.5, (3, len(system.operating_point))),
        owner=np.repeat(np.arange(3), lengths),
        offsets=offsets,
    )
    starts = generator.choice(data.window_starts(np.arange(3), steps), windows)
    x0 = data.x[starts] + 0.1 * draw(size=(windows, len(system.states)))
    return Problem(model(structure, generator), data, x0, starts, steps)


def model(structure: Augmented, generator: np.random.Generator, batch: int = 2) -> Nnap:
    """A stack with random weights, whose parameters are within a tenth of the file's."""
    values = np.array(structure.system.values)
    p = values * generator.uniform(0.9, 1.1, (batch, len(values)))
    unit = np.abs(values[list(structure.index)]) + (values[list(structure.index)] == 0.0)
    inputs, networks = len(structure.inputs), len(structure.networks)
    return Nnap(
        structure,
        torch.tensor(p),
        torch.tensor(unit),
        torch.tensor(generator.uniform(0.5, 2.0, (batch, inputs))),
        torch.tensor(generator.uniform(0.5, 2.0, (batch, networks))),
        torch.tensor(generator.normal(size=(batch, structure.size))),
    )


def one_state(rate: sp.Expr) -> Augmented:
    """x' = rate - F, with a parameter k."""
    parts = {"parameters": (Parameter("k", "N", 1.0),), "ports": (Port("end", "F", "m/s", "x"),)}
    made = replace(EMPTY, states=(State("x", "m"),), dynamics=(rate - symbol("F"),), **parts)
    return Augmented(made, (), ("k",))


def bare(system: System) -> Nnap:
    """The physics of a system alone, of which nothing is trained."""
    nothing = torch.empty(1, 0, dtype=torch.float64)
    p = torch.tensor([system.values], dtype=torch.float64)
    return Nnap(physics_only()(system, ()).structure, p, nothing[0], nothing, nothing, nothing)


def one_run(u: Array, period: float, states: int = 2) -> Measured:
    """One experiment with inputs (samples, inputs), whose states and constants are not measured."""
    n = len(u)
    x, t = np.zeros((n, states)), period * np.arange(n)
    return Measured(x, u, t, np.empty((1, 0)), np.zeros(n, np.int64), np.array([0, n]))


def by_kernel(given: Problem, member: int, how: Integration) -> Results:
    """Trajectory, efforts, and gradients of a random sum of both."""
    x0 = torch.tensor(given.x0, requires_grad=True)
    X, Z = rollout(given.model, member, given.data, x0, given.starts, given.steps, how)
    return _results(given.model, member, x0, X, Z)


def by_reference(given: Problem, member: int, how: Integration) -> Results:
    """The same by `Nnap.simulate`."""
    x0 = torch.tensor(given.x0, requires_grad=True)
    X, Z = simulated(given, x0, how)
    return _results(given.model, member, x0, X[member], Z[member])


def simulated(given: Problem, x0: Tensor, how: Integration) -> tuple[Tensor, Tensor]:
    """Trajectories and efforts of all models of the stack."""
    data, starts, everywhere = given.data, given.starts, (given.model.batch, len(given.starts))
    u = torch.tensor(data.u[starts[:, None] + np.arange(given.steps + 1)]).expand(*everywhere, -1, -1)
    c = torch.tensor(data.c[data.owner[starts]]).expand(*everywhere, -1)
    return given.model.simulate(x0.expand(*everywhere, -1), u, torch.tensor(data.t[starts]), c, how)


def _results(model: Nnap, member: int, x0: Tensor, X: Tensor, Z: Tensor) -> Results:
    generator = torch.Generator().manual_seed(1)
    draw = {"dtype": torch.float64, "generator": generator}
    loss = (X * torch.randn(X.shape, **draw)).sum() + (Z * torch.randn(Z.shape, **draw)).sum()
    inputs = {"x0": x0, "xi": model.xi, "weights": model.weights}
    gradients = torch.autograd.grad(loss, list(inputs.values()), allow_unused=True, materialize_grads=True)
    found = {"X": X.detach(), "Z": Z.detach(), "x0": gradients[0]}
    return found | {name: g[member] for name, g in zip(("xi", "weights"), gradients[1:], strict=True)}


def assert_equal(given: Problem, how: Integration, tolerance: float = 1e-10) -> None:
    """Both ways agree in value and gradient, relative to the largest number of each kind."""
    for member in range(given.model.batch):
        kernel, reference = by_kernel(given, member, how), by_reference(given, member, how)
        for name, expected in reference.items():
            assert torch.isfinite(expected).all(), (name, how)
            error = (kernel[name] - expected).abs()
            scale = expected.abs().amax() if expected.numel() else 1.0
            assert bool((error <= tolerance * (scale + 1e-3)).all()), (name, how, float(error.max()), scale)
