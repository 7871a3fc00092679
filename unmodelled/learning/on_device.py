"""Train on windows as `windows` does, by torch on any device: every operation is one of the whole stack."""

from __future__ import annotations

import time

import numpy as np
import torch
from torch import Tensor

from unmodelled.base.errors import BadInput
from unmodelled.base.progress import Counter
from unmodelled.learning.adam import Adam
from unmodelled.learning.windows import Problem, Progress, Training, Windows, drawn_windows, fall, weighting


def train_on(device: str, problem: Problem, windows: Training, stack: list[Progress]) -> None:
    """Train a stack to the end on a device of torch."""
    if not isinstance(windows, Windows):
        raise BadInput(f"device {device}: this training runs on the cpu only; device must be cpu")
    try:
        trainer = _Trainer(torch.device(device), problem, windows, stack)
    except (RuntimeError, AssertionError) as error:
        raise BadInput(f"device {device}: cannot be used ({str(error).splitlines()[0][:100]})") from None
    first = min(s.epoch for s in stack)
    with Counter(windows.epochs - first, f"training {len(stack)} models on {device}, epochs") as counter:
        for epoch in range(first, windows.epochs):
            trainer.epoch(epoch)
            counter.update(epoch - first + 1)
    problem.model.cpu()


class _Trainer:
    """The stack on its device, and everything that its mini-batches are taken from."""

    def __init__(
        self, device: torch.device, problem: Problem, windows: Windows, stack: list[Progress]
    ) -> None:
        self.problem, self.windows, self.stack = problem, windows, stack
        self.model = problem.model.to(device)
        data = problem.data
        self.x, self.u, self.t = (torch.from_numpy(a).to(device) for a in (data.x, data.u, data.t))
        self.c = torch.from_numpy(data.c[data.owner]).to(device)
        C_x = np.stack([weighting(data, runs, windows.horizon) for runs in problem.runs])
        self.C_x = torch.from_numpy(C_x).to(device)
        self.penalties = torch.from_numpy(problem.penalties).to(device)
        self.bounds = torch.from_numpy(problem.bounds).to(device) / self.model.unit[:, None]
        groups = [{"params": [self.model.weights]}, {"params": [self.model.xi]}]
        self.adam = Adam(groups, lr=windows.rate)

    def epoch(self, epoch: int) -> None:
        begin = time.perf_counter()
        draws = [drawn_windows(self.problem, self.windows, m, epoch) for m in range(len(self.stack))]
        # members of different size: as many mini-batches as the smallest has
        count, batch = (min(d.shape[axis] for d in draws) for axis in (0, 1))
        starts = torch.from_numpy(np.stack([d[:count, :batch] for d in draws]))
        shares = fall(self.windows, epoch, count)
        kept = self.model.weights.detach().clone(), self.model.xi.detach().clone()
        losses = [self._step(starts[:, b].to(self.x.device), float(shares[b])) for b in range(count)]
        mean = torch.stack(losses).mean(0).cpu().numpy()
        with torch.no_grad():
            for m, member in enumerate(self.stack):
                if member.diverged or not np.isfinite(mean[m]):
                    member.diverged = True
                    self.model.weights[m], self.model.xi[m] = kept[0][m], kept[1][m]
        self._record(mean, count, time.perf_counter() - begin)

    def _step(self, starts: Tensor, share: float) -> Tensor:
        for group, rate in zip(
            self.adam.param_groups, (self.windows.rate, self.windows.physics_rate), strict=True
        ):
            group["lr"] = rate * share
        loss = self._loss(starts)
        self.adam.zero_grad()
        # the members share nothing, so that the sum trains each of them on its own loss
        torch.nan_to_num(loss, nan=0.0, posinf=0.0).sum().backward()  # type: ignore[no-untyped-call]
        self._clip()
        self.adam.step()
        with torch.no_grad():
            self.model.xi.clamp_(self.bounds[:, 0], self.bounds[:, 1])
        return loss.detach()

    def _loss(self, starts: Tensor) -> Tensor:
        """Eq. 4.9 of every member, (members,), with the penalties of the networks' efforts."""
        steps = torch.arange(self.windows.horizon + 1, device=starts.device)
        at = starts[..., None] + steps
        X, Z = self.model.simulate(
            self.x[starts], self.u[at], self.t[starts], self.c[starts], self.problem.how
        )
        error = (X[..., 1:, :] - self.x[at[..., 1:]]).square().mean((1, 2))
        price = Z.square().mean((1, 2)) * self.penalties
        return (error * self.C_x).sum(1) + price.sum(1)

    def _clip(self) -> None:
        gradients = [p.grad for p in (self.model.weights, self.model.xi) if p.grad is not None]
        for g in gradients:
            g.nan_to_num_(nan=0.0, posinf=0.0, neginf=0.0)
        norm = torch.cat(gradients, 1).norm(dim=1, keepdim=True)
        for g in gradients:
            g.mul_((self.windows.clip / norm.clamp(min=1e-300)).clamp(max=1.0))

    def _record(
        self, mean: np.ndarray[tuple[int, ...], np.dtype[np.float64]], count: int, seconds: float
    ) -> None:
        model = self.model
        p, xi, weights = (a.detach().cpu().numpy() for a in (model.physics(), model.xi, model.weights))
        for m, member in enumerate(self.stack):
            member.p, member.xi, member.weights = p[m].copy(), xi[m].copy(), weights[m].copy()
            if not member.diverged:
                member.epoch += 1
                member.batches += count
                member.losses.append(float(mean[m]))
                member.history.append(member.p[list(model.structure.index)].copy())
                member.seconds.append(seconds / len(self.stack))
