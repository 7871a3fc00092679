"""What a file of conf/model/ says about a hybrid model of a system: which networks, which parameters, fitted
how.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from unmodelled.base.errors import BadInput
from unmodelled.engine.compiled.structure import Augmented
from unmodelled.engine.free_run import Integration, Method
from unmodelled.learning.windows import Problem, Training
from unmodelled.models.nnap import Nnap
from unmodelled.models.rollout import Measured
from unmodelled.models.structures import Plan, Structure
from unmodelled.systems.model import System
from unmodelled.systems.reference import torch_equations

Array = NDArray[np.float64]

#: Samples over which a measured slope is taken to estimate the size of the missing effort; one is too noisy.
LAG = 10
#: Samples that tell these scales well enough.
ENOUGH = 4000
Indices = NDArray[np.int64]


@dataclass(frozen=True)
class AugmentedRecipe:
    """A hybrid model of a system and its training.

    Attributes:
        networks: which networks sit where: a function of `unmodelled.models.structures`.
        windows: how it is trained.
        identify: parameters that are trained too; None: those that the system file marks.
        spread: their starts are drawn from 1 +- spread times their value, within their bounds.
        spread_of_fixed: the parameters that are not trained are drawn from 1 +- this times their value.
        method, substeps, hold: of the integration, see `Integration`.
    """

    networks: Structure
    windows: Training
    identify: tuple[str, ...] | None = None
    spread: float = 0.0
    spread_of_fixed: float = 0.0
    method: Method = "euler"
    substeps: int = 1
    hold: float = 0.0

    def plan(self, system: System) -> Plan:
        """The structure for `system`.

        Raises:
            BadInput: when a parameter to identify does not exist.
        """
        names = [p.name for p in system.parameters]
        trained = system.uncertain if self.identify is None else tuple(self.identify)
        for name in trained:
            if name not in names:
                raise BadInput(f"identify: unknown parameter {name!r}, must be one of {', '.join(names)}")
        return self.networks(system, trained)

    def integration(self, period: float) -> Integration:
        """The integration of samples `period` seconds apart."""
        if self.method not in ("euler", "rk4"):
            raise BadInput(f"method must be euler or rk4, got {self.method}")
        return Integration(period, self.method, self.substeps, self.hold)

    def problem(
        self, system: System, data: Measured, period: float, runs: list[Indices], seed: int
    ) -> Problem:
        """A stack of untrained models, one per entry of `runs`, and what they are fitted to.

        Scales come from each member's own training experiments.
        """
        plan = self.plan(system)
        structure = plan.structure
        # a member's own source, so that it starts the same whatever the size of the stack
        sources = [np.random.default_rng([seed, member]) for member in range(len(runs))]
        p = np.stack([_start(self, structure, rng) for rng in sources])
        values = {q.name: q for q in structure.system.parameters}
        unit = np.array([abs(values[n].value) or 1.0 for n in structure.trainable])
        bounds = np.array([values[n].limits for n in structure.trainable]).reshape(-1, 2)
        scale, gain = _scales(structure, data, runs, torch.from_numpy(p), period)
        weights = np.stack([_initial_weights(structure, rng) for rng in sources])
        tensors = (torch.from_numpy(a) for a in (p, unit, scale, gain, weights))
        penalties = np.asarray(plan.penalties, np.float64)
        how = self.integration(period)
        return Problem(Nnap(structure, *tensors), data, runs, bounds, penalties, how, seed)


def check_pairing(model: object, system: Path | None, logs: Path | None) -> None:
    """A hybrid model of a system comes with a system and its logs, another model without.

    Raises:
        BadInput: when it does not.
    """
    if (system is None) != (logs is None):
        raise BadInput("system and logs must be given together")
    if isinstance(model, AugmentedRecipe) != (system is not None):
        raise BadInput(
            "a hybrid model of a system (hybrid, nnap, ...) must have system= and logs=, another must not"
        )


def start_from(problem: Problem, fitted: Nnap) -> None:
    """Begin where `fitted`, a stack of the same structure, ended.

    Raises:
        BadInput: when it has another number of models or another structure.
    """
    model = problem.model
    if (fitted.batch, fitted.weights.shape) != (model.batch, model.weights.shape):
        raise BadInput(
            f"the fit to start from must have {model.batch} models of {model.weights.shape[1]} weights, "
            f"got {fitted.batch} of {fitted.weights.shape[1]}"
        )
    model.load_state_dict(fitted.state_dict())


def _start(recipe: AugmentedRecipe, structure: Augmented, rng: np.random.Generator) -> Array:
    """(parameters,) where one member starts."""
    start = np.array(structure.system.values)
    for k, parameter in enumerate(structure.system.parameters):
        trained = parameter.name in structure.trainable
        spread = recipe.spread if trained else recipe.spread_of_fixed
        start[k] *= 1.0 + spread * rng.uniform(-1.0, 1.0)
        if trained:
            start[k] = np.clip(start[k], *parameter.limits)
    return start


def _initial_weights(structure: Augmented, rng: np.random.Generator) -> Array:
    """Glorot uniform; hidden biases uniform, so that the kinks do not all lie at zero."""
    parts = []
    for network in structure.networks:
        ni, nh = len(network.inputs), network.hidden
        inner, outer = np.sqrt(6.0 / (ni + nh)), np.sqrt(6.0 / (nh + 1))
        parts += [rng.uniform(-inner, inner, ni * nh), rng.uniform(-1.0, 1.0, nh)]
        parts += [rng.uniform(-outer, outer, nh), np.zeros(1)]
    return np.concatenate(parts) if parts else np.empty(0)


def _scales(
    structure: Augmented, data: Measured, runs: list[Indices], p: Tensor, period: float
) -> tuple[Array, Array]:
    """1 / standard deviation of every network input (eq. 4.4), and every network's gain, per member.

    The gain is the size of the effort that the physics misses: least squares of the measured acceleration's
    residual on the port's influence.
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
        missing = torch.from_numpy(slope) - known.detach()
        size = missing.square().mean(0).sqrt().clamp(min=1e-30)
        influence = torch.stack(
            [
                torch.autograd.grad(known[:, i].sum(), e, retain_graph=True)[0] / size[i]
                for i in range(x.shape[1])
            ],
            1,
        )
        projected = torch.einsum("sie,si->se", influence, missing / size)
        power = influence.square().sum(1)
        found = (projected.square().sum(0) / power.square().sum(0).clamp(min=1e-300)).sqrt().numpy()
        gain[m] = [found[names.index(n.port)] or 1.0 for n in structure.networks]
    return scale, gain
