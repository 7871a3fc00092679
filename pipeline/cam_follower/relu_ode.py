"""ReLU-ODE models of section 6.4: black box, soft hybrid and hybrid."""

import math

import torch
from torch import Generator, Tensor, nn

from pipeline.cam_follower import cam_follower as physics
from pipeline.cam_follower.conditions import Bench, Conditions
from pipeline.cam_follower.dynamics import Dynamics
from pipeline.cam_follower.kernels import torch_function


class ReluNetwork(nn.Module):
    """A stack of `batch` ReLU networks with one hidden layer, eq. 6.18."""

    scale: Tensor  # (batch, 1, inputs), inverse standard deviation over the training data

    def __init__(self, scale: Tensor, hidden: int, generator: Generator) -> None:
        super().__init__()
        batch, inputs = scale.shape
        self.register_buffer("scale", 1.0 / scale[:, None, :])
        self.W_h = nn.Parameter(glorot(batch, inputs, hidden, generator))
        self.b_h = nn.Parameter(torch.zeros(batch, 1, hidden))
        self.W_o = nn.Parameter(glorot(batch, hidden, 1, generator))
        self.b_o = nn.Parameter(torch.zeros(batch, 1, 1))

    def forward(self, d: Tensor) -> Tensor:
        """Return the outputs of all networks. Takes d (batch, samples, inputs); gives (batch, samples)."""
        hidden = torch.baddbmm(self.b_h, d * self.scale, self.W_h).relu()
        return torch.baddbmm(self.b_o, hidden, self.W_o)[..., 0]


def glorot(batch: int, rows: int, columns: int, generator: Generator) -> Tensor:
    """Return random weights by Glorot's uniform rule; gives (batch, rows, columns)."""
    limit = math.sqrt(6.0 / (rows + columns))
    return (torch.rand(batch, rows, columns, generator=generator) * 2.0 - 1.0) * limit


def cam_inputs(dh: Tensor, d2h: Tensor, omega: Tensor, q: Conditions) -> Tensor:
    """Return d_H1 = d_H2: the cam's derivatives, speed, V and m (section 6.4.4), (batch, runs, 5)."""
    return torch.stack([dh, d2h, omega, q.V.expand_as(dh), q.m.expand_as(dh)], -1)


class BlackBox(Dynamics):
    """Model f_BB: the network maps angle, speed and settings to the acceleration (section 6.4.3).

    Args:
        bench: mechanism and cams.
        scale: standard deviation of every input over the training data, shape (batch, inputs).
        generator: random generator of the initial weights.
        hidden: number of hidden units.
        curve: "pitch" or "theoretical" cam curve; default "theoretical".
    """

    #: The network's output of order one becomes an acceleration, rad/s^2.
    OUTPUT = 100.0

    def __init__(
        self, bench: Bench, scale: Tensor, generator: Generator, hidden: int, curve: str = "theoretical"
    ) -> None:
        super().__init__(bench, len(scale), curve)
        self.network = ReluNetwork(scale, hidden, generator)

    def acceleration(self, theta: Tensor, omega: Tensor, q: Conditions) -> Tensor:
        output: Tensor = self.network(self.inputs(theta, omega, q))
        return output * self.OUTPUT


class SoftHybrid(BlackBox):
    """Model f_H1: dh/dtheta and d2h/dtheta2 replace the angle, H and beta (section 6.4.4)."""

    def inputs(self, theta: Tensor, omega: Tensor, q: Conditions) -> Tensor:
        dh, d2h = self.cams(q.cam, theta)
        return cam_inputs(dh, d2h, omega, q)


class Hybrid(Dynamics):
    """Model f_H2: the equation of the drivetrain is known, the network gives the torque of the drive (section
    6.4.4).

    The inertia J of the shaft is trained together with the network.

    Args:
        bench: mechanism and cams.
        scale: standard deviation of every input over the training data, shape (batch, 5).
        generator: random generator of the initial weights.
        hidden: number of hidden units.
        inertia: inertia J of the shaft before training, kg m^2; default 0.01.
        curve: "pitch" or "theoretical" cam curve; default "theoretical".
    """

    #: The network's output of order one becomes a torque of the drive's order, N m.
    OUTPUT = 0.5

    def __init__(
        self,
        bench: Bench,
        scale: Tensor,
        generator: Generator,
        hidden: int,
        inertia: float = 0.01,
        curve: str = "theoretical",
    ) -> None:
        super().__init__(bench, len(scale), curve)
        self.network = ReluNetwork(scale, hidden, generator)
        # the logarithm keeps the inertia positive
        self.log_J = nn.Parameter(torch.full((len(scale), 1), math.log(inertia)))
        self.constants = bench.mechanism.constants
        symbols = (physics.T_d, physics.omega, physics.dh, physics.d2h, physics.m, physics.J)
        self._equation = torch_function(physics.ACCELERATION, (*symbols, *physics.CONSTANTS))

    def inputs(self, theta: Tensor, omega: Tensor, q: Conditions) -> Tensor:
        dh, d2h = self.cams(q.cam, theta)
        return cam_inputs(dh, d2h, omega, q)

    def acceleration(self, theta: Tensor, omega: Tensor, q: Conditions) -> Tensor:
        dh, d2h = self.cams(q.cam, theta)
        torque = self.network(cam_inputs(dh, d2h, omega, q)) * self.OUTPUT
        result: Tensor = self._equation(torque, omega, dh, d2h, q.m, self.log_J.exp(), *self.constants)
        return result
