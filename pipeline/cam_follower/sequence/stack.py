"""Train all repeats of a fold as one stack by torch, on any device."""

from collections.abc import Callable, Sequence

import numpy as np
import torch
from torch import Tensor

from pipeline.cam_follower.sequence.arrays import Sizes, views
from pipeline.cam_follower.sequence.layout import flattened, restore, sizes
from pipeline.cam_follower.sequence.passes import EPSILON, FIRST, SECOND
from pipeline.cam_follower.sequence.training import Course, Draws, Start, Training
from unmodelled.base.errors import BadInput


def train_stack(starts: Sequence[Start], training: Training, device: str) -> list[Course]:
    """Train networks of the same shape on the same runs, in place."""
    try:
        stack = _Stack(starts, training, torch.device(device))
    except (RuntimeError, AssertionError) as error:
        raise BadInput(f"device {device}: cannot be used ({str(error).splitlines()[0][:100]})") from None
    while not all(course.over for course in stack.courses):
        stack.epoch()
    for start, p in zip(starts, stack.p.detach().cpu().numpy(), strict=True):
        restore(start.network, p)
    return stack.courses


class _Stack:
    """Weights (members, weights) on their device, with the moments of Adam and what they are trained on."""

    def __init__(self, starts: Sequence[Start], training: Training, device: torch.device) -> None:
        runs = starts[0].runs
        self.s, self.training, self.dropout = sizes(starts[0].network), training, starts[0].network.dropout.p
        self.p = torch.from_numpy(np.stack([flattened(s.network) for s in starts])).to(device)
        self.p.requires_grad_()
        self.m, self.v = (torch.zeros_like(self.p) for _ in range(2))
        self.tau, self.q, self.target, self.lengths = (torch.from_numpy(a).to(device) for a in runs)
        self.draws = [Draws(runs.lengths, training.batch, s.seed) for s in starts]
        self.courses = [Course(training) for _ in starts]
        self.kept = self.p.detach().clone()
        self.generator = torch.Generator(device).manual_seed(starts[0].seed)

    def epoch(self) -> None:
        edges, done = self.draws[0].edges, max(course.updates for course in self.courses)
        order = torch.from_numpy(np.stack([d.epoch() for d in self.draws])).to(self.p.device)
        rates = [0.0 if course.over else course.rate for course in self.courses]
        rate = torch.tensor(rates, device=self.p.device)[:, None]
        total = torch.zeros(len(self.courses), device=self.p.device)
        for b in range(len(edges) - 1):
            loss = self._loss(order[:, edges[b] : edges[b + 1]])
            # the members share nothing, so that the sum trains each of them on its own loss
            (slope,) = torch.autograd.grad(loss.sum(), self.p)
            self._step(slope, rate, done + b + 1)
            total += loss.detach()
        mean = (total / (len(edges) - 1)).tolist()
        for k, course in enumerate(self.courses):
            if not course.over:
                self._conclude(k, course, mean[k], len(edges) - 1)

    @torch.no_grad()
    def _conclude(self, k: int, course: Course, loss: float, batches: int) -> None:
        checks = len(course.losses)
        course.after_epoch(loss, batches)
        if course.diverged:
            self.p[k] = self.kept[k]
        elif len(course.losses) > checks:
            self.kept[k] = self.p[k]

    def _loss(self, rows: Tensor) -> Tensor:
        """Mean squared error over the real samples of the runs `rows` (members, runs), for every member."""
        lengths = self.lengths[rows]
        steps = int(lengths.max())
        real = torch.arange(steps, device=rows.device) < lengths[..., None]
        output = scaled_output(self.p, self.s, self.tau[rows, :steps], self.q[rows], self._ignored)
        error = torch.where(real, output - self.target[rows, :steps], 0.0)
        return error.square().sum((1, 2)) / lengths.sum(1)

    def _ignored(self, units: Tensor) -> Tensor:
        if self.dropout == 0.0:
            return units
        kept = torch.rand(units.shape, generator=self.generator, device=units.device) >= self.dropout
        return torch.where(kept, units / (1.0 - self.dropout), 0.0)

    @torch.no_grad()
    def _step(self, slope: Tensor, rate: Tensor, number: int) -> None:
        norm = slope.norm(dim=1, keepdim=True)
        slope = slope * (self.training.clip / norm.clamp(min=self.training.clip))
        self.m.lerp_(slope, 1.0 - FIRST)
        self.v.lerp_(slope.square(), 1.0 - SECOND)
        spread = self.v.sqrt() / float(np.sqrt(1.0 - SECOND**number)) + float(EPSILON)
        # a member that is over stands still even where its gradient is not a number
        change = torch.where(rate > 0.0, rate / (1.0 - FIRST**number) * self.m / spread, 0.0)
        self.p -= change


def scaled_output(
    p: Tensor, s: Sizes, tau: Tensor, q: Tensor, ignored: Callable[[Tensor], Tensor] = lambda units: units
) -> Tensor:
    """Return the standardised outputs of a stack of networks, eq. 5.8 to 5.12.

    Takes p (members, weights), tau (members, runs, steps, features), q (members, runs, settings), ignored
    (members, runs, steps, head); gives (members, runs, steps).
    """
    members, runs, steps = tau.shape[:3]
    lengths = [len(part) for part in views(np.zeros(s.weights, np.float32), s)]
    parts = torch.tensor_split(p, np.cumsum(lengths)[:-1].tolist(), dim=1)
    # the four gates side by side
    by_tau = parts[0].view(members, 4, s.features, s.hidden).transpose(1, 2).flatten(2)
    by_state = parts[1].view(members, 4, s.hidden, s.hidden).transpose(1, 2).flatten(2)
    entering = torch.baddbmm(parts[2][:, None], tau.flatten(1, 2), by_tau).view(members, runs, steps, -1)
    state = cell = tau.new_zeros((members, runs, s.hidden))
    states = []
    for entry in entering.unbind(2):
        gates = torch.baddbmm(entry, state, by_state)
        i, f, o = gates[..., : 3 * s.hidden].sigmoid().chunk(3, -1)
        cell = f * cell + i * gates[..., 3 * s.hidden :].tanh()
        state = o * cell.tanh()
        states.append(state)
    all_states = torch.stack(states, 2).flatten(1, 2)
    units = torch.bmm(all_states, parts[3].view(members, s.hidden, s.head)).view(members, runs, steps, -1)
    constant = torch.baddbmm(parts[5][:, None], q, parts[4].view(members, s.settings, s.head))
    units = ignored((units + constant[:, :, None]).relu())
    output: Tensor = (units * parts[6][:, None, None]).sum(-1) + parts[7][:, :, None]
    return output
