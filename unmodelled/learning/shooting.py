"""Train hybrid models by multiple shooting (section 7.2.1).

A free run is cut into segments whose first states are trained too. Gaps between the segments are penalised
more and more, until the segments form one trajectory.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
import torch
from scipy.optimize import OptimizeResult, minimize
from torch import Tensor

from unmodelled.base.arrays import Array, Indices
from unmodelled.base.errors import BadInput
from unmodelled.base.threads import one_thread
from unmodelled.base.workers import threads_of
from unmodelled.engine.compiled.compiled import kernel
from unmodelled.learning.nnap import Nnap
from unmodelled.learning.rollout import Measured, rollout
from unmodelled.learning.windows import Problem, Progress, Windows, weighting

#: Loss in place of one that is not finite, so that a line search turns back; a usual loss is below one.
BLOWN_UP = 1e10
#: Scale of the first states relative to the weights, for L-BFGS: the square root of the loss's curvature.
NODE_SCALE = 0.3
#: Number of steps that L-BFGS remembers.
MEMORY = 30


@dataclass(frozen=True)
class Shooting:
    """Settings of multiple shooting: a warm-up, then stages with a growing penalty of the gaps.

    An epoch is one of the warm-up, then one iteration of L-BFGS over all segments. Every stage restarts
    L-BFGS, so that a training that was killed repeats no more than one stage.

    Attributes:
        horizon: number of samples N of a segment.
        iterations: number of iterations of L-BFGS over all stages.
        warm_up: settings of the training on windows before the first stage.
        stages: number of stages; default 10.
        first_price: penalty of the mean squared gap in the first stage, relative to the misfit; default 0.1.
        last_price: penalty in the last stage; those between form a geometric series; default 10.
        workers: number of models of a stack that are trained side by side; default 2.
    """

    horizon: int
    iterations: int
    warm_up: Windows
    stages: int = 10
    first_price: float = 0.1
    last_price: float = 10.0
    workers: int = field(default=2, repr=False)

    @property
    def epochs(self) -> int:
        """Number of epochs of the warm-up and of shooting together."""
        return self.warm_up.epochs + self.iterations

    def train(self, problem: Problem, stack: list[Progress]) -> Iterator[int]:
        """Train a stack to the end.

        Args:
            problem: models and data.
            stack: state of the training of every model, which is changed in place.

        Yields:
            Number of epochs done over all models; the stack may be saved whenever it is yielded.

        Raises:
            BadInput: when no training experiment of a model is as long as the horizon.
        """
        cuts = [Segments.of(problem.data, runs, self.horizon) for runs in problem.runs]
        yield from self.warm_up.train(problem, stack)
        kernel(problem.model.structure)  # generated once, not by every thread
        # the members share the cores, and sums do not depend on how many there are
        with one_thread(), threads_of(self.workers) as pool:
            left = self._unfinished(stack)
            while left:
                jobs = [
                    pool.submit(_stage, problem, self, stack[m], m, cuts[m]) for m in left[: self.workers]
                ]
                for job in jobs:
                    job.result()
                yield sum(self.epochs if s.diverged else s.epoch for s in stack)
                left = self._unfinished(stack)

    def _unfinished(self, stack: list[Progress]) -> list[int]:
        return [m for m, s in enumerate(stack) if s.epoch < self.epochs and not s.diverged]

    def stage(self, epoch: int) -> tuple[int, float]:
        """Return the stage that follows after a number of epochs.

        Args:
            epoch: number of finished epochs.

        Returns:
            Last epoch of the stage, and its penalty of the mean squared gap.

        Examples:
            >>> Shooting(50, 20, Windows(1, 10), stages=2).stage(15)
            (20, 0.1)
        """
        ends = [self.warm_up.epochs + self.iterations * (k + 1) // self.stages for k in range(self.stages)]
        k = next(k for k, end in enumerate(ends) if end > epoch)
        share = k / max(1, self.stages - 1)
        return ends[k], self.first_price * (self.last_price / self.first_price) ** share


@dataclass(frozen=True)
class Segments:
    """Experiments in segments of equal length, which overlap where it does not divide an experiment."""

    steps: int  # number of samples of every segment
    starts: Indices  # (segments,), first samples
    joined: Indices  # (joints,), segments that another one of the same experiment follows
    after: Indices  # (joints,), samples from the start of such a segment to that of the next

    @classmethod
    def of(cls, data: Measured, runs: Indices, steps: int) -> Segments:
        """Cut experiments (k,) into segments; experiments shorter than a segment are left out."""
        starts: list[Indices] = []
        for first, end in zip(data.offsets[runs], data.offsets[runs + 1], strict=True):
            last = end - 1 - steps
            if last >= first:
                count = -(-(end - 1 - first) // steps)
                starts.append(np.round(np.linspace(first, last, count)).astype(np.int64))
        if not starts:
            raise BadInput(f"no training experiment has more than {steps} samples, the horizon")
        every = np.concatenate(starts)
        joined = np.flatnonzero(np.diff(data.owner[every]) == 0)
        return cls(steps, every, joined, every[joined + 1] - every[joined])


class Objective:
    """The loss of one model as a function of everything that is trained, with its gradient.

    `price` is the penalty of the mean squared gap between segments, relative to the misfit.
    """

    def __init__(self, problem: Problem, member: int, cut: Segments, price: float) -> None:
        stack, own = problem.model, slice(member, member + 1)
        # a copy, for the stack's weights are where it starts
        weights = stack.weights.detach()[own].clone()
        self.model = Nnap(
            stack.structure, stack.p[own], stack.unit, stack.scale[own], stack.gain[own], weights
        )
        self.problem, self.cut, self.price = problem, cut, price
        data = problem.data
        self.C = torch.from_numpy(weighting(data, problem.runs[member], cut.steps))
        self.measured = torch.from_numpy(data.x[cut.starts[:, None] + np.arange(cut.steps + 1)])
        self.penalties = torch.from_numpy(problem.penalties)
        # curvature by a scaled first state is of order NODE_SCALE^2, whatever its unit and the price
        self.unit = NODE_SCALE * torch.sqrt(len(cut.starts) / (1.0 + 2.0 * price) / self.C)

    def pack(self, state: Progress) -> Array:
        """Return weights, scaled parameters and scaled first states as one vector (size,)."""
        nodes = (torch.from_numpy(state.nodes) - self.measured[:, 0]) / self.unit
        return np.concatenate([state.weights, state.xi, nodes.numpy().ravel()])

    def unpack(self, z: Array) -> tuple[Array, Array, Array]:
        """Split a vector of `pack` into weights (size,), xi (trained,) and nodes (segments, states)."""
        size, trained = self.model.weights.shape[1], self.model.xi.shape[1]
        weights, xi, nodes = np.split(z, [size, size + trained])
        scaled = torch.from_numpy(nodes).view(len(self.cut.starts), -1)
        return weights, xi, (self.measured[:, 0] + self.unit * scaled).numpy()

    def bounds(self) -> Array:
        """Return bounds (size, 2) of a vector of `pack`; only those of the parameters are finite."""
        low_high = self.problem.bounds / self.model.unit.numpy()[:, None]
        free = np.array([[-np.inf, np.inf]])
        size, nodes = self.model.weights.shape[1], self.measured[:, 0].numel()
        return np.concatenate([free.repeat(size, 0), low_high, free.repeat(nodes, 0)])

    def loss(self, nodes: Tensor) -> Tensor:
        """Return the misfit of all samples (eq. 4.9) plus the penalties of gaps and of efforts."""
        X, Z = rollout(
            self.model, 0, self.problem.data, nodes, self.cut.starts, self.cut.steps, self.problem.how
        )
        joined, after = torch.from_numpy(self.cut.joined), torch.from_numpy(self.cut.after)
        misfit = (X - self.measured).square().mean((0, 1))
        # without a joint the mean of nothing would be NaN
        gap = (X[joined, after] - nodes[joined + 1]).square().sum(0) / max(1, len(joined))
        efforts = Z.square().mean((0, 1)) @ self.penalties
        return self.C @ (misfit + self.price * gap) + efforts

    def __call__(self, z: Array) -> tuple[float, Array]:
        """Return the loss and its gradient (size,) at a vector (size,) of `pack`."""
        weights, xi, nodes = self.unpack(z)
        with torch.no_grad():
            self.model.weights[0] = torch.from_numpy(weights)
            self.model.xi[0] = torch.from_numpy(xi)
        at = torch.from_numpy(nodes).requires_grad_()
        loss = self.loss(at)
        found = torch.autograd.grad(loss, (self.model.weights, self.model.xi, at))
        gradient = torch.cat([found[0][0], found[1][0], (found[2] * self.unit).flatten()])
        if not (torch.isfinite(loss) and torch.all(torch.isfinite(gradient))):
            return BLOWN_UP, np.zeros_like(z)
        return float(loss.detach()), gradient.numpy()


def _stage(problem: Problem, shooting: Shooting, state: Progress, member: int, cut: Segments) -> None:
    """One stage of one member; `state` changes at its end only."""
    if not len(state.nodes):
        state.nodes = problem.data.x[cut.starts]
    end, price = shooting.stage(state.epoch)
    objective = Objective(problem, member, cut, price)
    start = objective.pack(state)
    if objective(start)[0] >= BLOWN_UP:
        state.diverged = True
        return
    x, rows = _minimize(objective, start, end - state.epoch)
    state.weights, state.xi, state.nodes = (a.copy() for a in objective.unpack(x))
    unit = objective.model.unit.numpy()
    state.p[list(problem.model.structure.index)] = unit * state.xi
    # where L-BFGS finds no better point, the rest of the stage stands still
    rows += [(objective(x)[0], state.xi, 0.0)] * (end - state.epoch - len(rows))
    for loss, xi, seconds in rows:
        state.losses.append(loss)
        state.history.append(unit * xi)
        state.seconds.append(seconds)
    state.epoch = end


def _minimize(
    objective: Objective, start: Array, iterations: int
) -> tuple[Array, list[tuple[float, Array, float]]]:
    """Minimise by L-BFGS, and return the result with loss, xi and seconds of every iteration."""
    rows: list[tuple[float, Array, float]] = []
    last = time.perf_counter()

    def record(intermediate_result: OptimizeResult) -> None:
        nonlocal last
        now = time.perf_counter()
        xi = objective.unpack(intermediate_result.x)[1].copy()
        rows.append((float(intermediate_result.fun), xi, now - last))
        last = now

    options = {"maxiter": iterations, "maxfun": 20 * iterations, "maxcor": MEMORY, "ftol": 0.0, "gtol": 0.0}
    how = {"method": "L-BFGS-B", "bounds": objective.bounds(), "options": options}
    found = minimize(objective, start, jac=True, callback=record, **how)
    return np.asarray(found.x, np.float64), rows
