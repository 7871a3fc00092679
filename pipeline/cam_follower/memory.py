"""Black-box models with a memory (sections 2.5.1 and 2.5.2): NARX, and a vanilla recurrent network."""

import math

import torch
from torch import Generator, Tensor, nn

from pipeline.cam_follower.conditions import Bench, Conditions
from pipeline.cam_follower.dynamics import Dynamics
from pipeline.cam_follower.relu_ode import BlackBox, ReluNetwork, glorot

#: Of the inputs of f_BB, those that change during a run: sine and cosine of the angle, and the speed.
CHANGING = 3


class Remembering(Dynamics):
    """A model that reads the inputs of f_BB and a memory of the samples before."""

    def acceleration(self, theta: Tensor, omega: Tensor, q: Conditions) -> Tensor:
        return self.react(self.begin(theta, omega, q), theta, omega, q)[0]


class Narx(Remembering):
    """NARX: the network also reads angle and speed at earlier samples, eq. 2.9.

    Before the start of a run, the machine is taken to have been in its first state.

    Args:
        bench: mechanism and cams.
        scale: standard deviation of every input of f_BB over the training data, shape (batch, 7).
        generator: random generator of the initial weights.
        hidden: number of hidden units.
        lags: number of samples that the network reads, N_y.
    """

    def __init__(self, bench: Bench, scale: Tensor, generator: Generator, hidden: int, lags: int) -> None:
        super().__init__(bench, len(scale), "theoretical")
        self.lags = lags
        changing = scale[:, :CHANGING].repeat(1, lags - 1)
        self.network = ReluNetwork(torch.cat([_own(scale), changing], 1), hidden, generator)

    def begin(self, theta: Tensor, omega: Tensor, q: Conditions) -> Tensor:
        return self.inputs(theta, omega, q)[..., :CHANGING].repeat(1, 1, self.lags - 1)

    def react(self, memory: Tensor, theta: Tensor, omega: Tensor, q: Conditions) -> tuple[Tensor, Tensor]:
        now = self.inputs(theta, omega, q)
        output: Tensor = self.network(torch.cat([now, memory], -1))
        latest = torch.cat([now[..., :CHANGING], memory], -1)[..., : memory.shape[-1]]
        return output * BlackBox.OUTPUT, latest


class RecurrentNetwork(nn.Module):
    """A stack of `batch` recurrent networks with one layer of tanh neurons, eq. 2.10."""

    scale: Tensor  # (batch, 1, inputs), inverse standard deviation over the training data

    def __init__(self, scale: Tensor, hidden: int, generator: Generator) -> None:
        super().__init__()
        batch, inputs = scale.shape
        self.register_buffer("scale", 1.0 / scale[:, None, :])
        self.W_i = nn.Parameter(glorot(batch, inputs, hidden, generator))
        self.W_h = nn.Parameter(glorot(batch, hidden, hidden, generator) / math.sqrt(2.0))
        self.b_h = nn.Parameter(torch.zeros(batch, 1, hidden))
        self.W_o = nn.Parameter(glorot(batch, hidden, 1, generator))
        self.b_o = nn.Parameter(torch.zeros(batch, 1, 1))

    def forward(self, d: Tensor, h: Tensor) -> tuple[Tensor, Tensor]:
        """Return outputs (batch, runs) and next states; d (batch, runs, inputs), h (batch, runs, hidden)."""
        state = (torch.baddbmm(self.b_h, d * self.scale, self.W_i) + h @ self.W_h).tanh()
        return torch.baddbmm(self.b_o, state, self.W_o)[..., 0], state


class Recurrent(Remembering):
    """Vanilla recurrent network: a state h that nothing measures is carried along a run, from h = 0.

    Args:
        bench: mechanism and cams.
        scale: standard deviation of every input of f_BB over the training data, shape (batch, 7).
        generator: random generator of the initial weights.
        hidden: size of the state h.
    """

    def __init__(self, bench: Bench, scale: Tensor, generator: Generator, hidden: int) -> None:
        super().__init__(bench, len(scale), "theoretical")
        self.hidden = hidden
        self.network = RecurrentNetwork(_own(scale), hidden, generator)

    def begin(self, theta: Tensor, omega: Tensor, q: Conditions) -> Tensor:
        return theta.new_zeros((*theta.shape, self.hidden))

    def react(self, memory: Tensor, theta: Tensor, omega: Tensor, q: Conditions) -> tuple[Tensor, Tensor]:
        output, state = self.network(self.inputs(theta, omega, q), memory)
        return output * BlackBox.OUTPUT, state


def _own(scale: Tensor) -> Tensor:
    """Scale of the inputs of f_BB; that of a fit that is read back has the inputs of the memory, too."""
    return scale[:, : 4 + CHANGING]
