"""Base class of all models of the drivetrain."""

from abc import ABC, abstractmethod

import torch
from torch import Tensor, nn

from pipeline.cam_follower.conditions import Bench, CamTable, Conditions
from pipeline.cam_follower.integrate import Method, rollout


def raw_inputs(theta: Tensor, omega: Tensor, q: Conditions) -> Tensor:
    """Return d_BB: sin and cos of the angle, speed, V, m, H, beta (section 6.4.3), (batch, runs, 7)."""
    settings = [x.expand_as(theta) for x in (q.V, q.m, q.H, q.beta)]
    return torch.stack([theta.sin(), theta.cos(), omega, *settings], -1)


class Dynamics(nn.Module, ABC):
    """A stack of `batch` independently fitted models of the acceleration of the shaft.

    Args:
        bench: mechanism and cams.
        batch: number of models.
        curve: "pitch" or "theoretical" cam curve, see `Bench.curves`.

    Attributes:
        method: integration method of the free run.
        substeps: number of integration steps per sampling period.
    """

    method: Method = "euler"
    substeps: int = 1

    def __init__(self, bench: Bench, batch: int, curve: str) -> None:
        super().__init__()
        self.batch = batch
        self.cams = CamTable(torch.tensor(bench.curves(curve), dtype=torch.float32))

    @abstractmethod
    def acceleration(self, theta: Tensor, omega: Tensor, q: Conditions) -> Tensor:
        """Return the angular acceleration of the shaft.

        Args:
            theta: angle of the cam, rad, shape (batch, runs).
            omega: speed of the cam, rad/s, shape (batch, runs).
            q: operating points, each of shape (runs,) or (batch, runs).

        Returns:
            Acceleration, rad/s^2, shape (batch, runs).
        """

    def inputs(self, theta: Tensor, omega: Tensor, q: Conditions) -> Tensor:
        """Return the inputs of the network in the model; the default are those of f_BB.

        Args:
            theta: angle of the cam, rad, shape (batch, runs).
            omega: speed of the cam, rad/s, shape (batch, runs).
            q: operating points, each of shape (runs,) or (batch, runs).

        Returns:
            Inputs, shape (batch, runs, inputs).
        """
        return raw_inputs(theta, omega, q)

    def begin(self, theta: Tensor, omega: Tensor, q: Conditions) -> Tensor:
        """Return the memory at the start of a run; empty for a model without one.

        Args:
            theta: angle of the cam, rad, shape (batch, runs).
            omega: speed of the cam, rad/s, shape (batch, runs).
            q: operating points, each of shape (runs,) or (batch, runs).

        Returns:
            Memory, shape (batch, runs, numbers).
        """
        return theta.new_zeros((*theta.shape, 0))

    def react(self, memory: Tensor, theta: Tensor, omega: Tensor, q: Conditions) -> tuple[Tensor, Tensor]:
        """Return the acceleration at a sample, and the memory for the next one.

        Args:
            memory: memory of the samples before, shape (batch, runs, numbers).
            theta: angle of the cam, rad, shape (batch, runs).
            omega: speed of the cam, rad/s, shape (batch, runs).
            q: operating points, each of shape (runs,) or (batch, runs).

        Returns:
            Acceleration, rad/s^2, shape (batch, runs), and memory.
        """
        return self.acceleration(theta, omega, q), memory

    @torch.no_grad()
    def simulate(
        self, theta: Tensor, omega: Tensor, q: Conditions, steps: int, period: float
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Simulate a free run from the initial state.

        Args:
            theta: angle of the cam, rad, shape (batch, runs).
            omega: speed of the cam, rad/s, shape (batch, runs).
            q: operating points, each of shape (runs,) or (batch, runs).
            steps: number of sampling periods.
            period: sampling period, s.

        Returns:
            Angle (rad), speed (rad/s) and acceleration (rad/s^2) at every sample, each of shape (batch, runs,
            steps + 1).
        """
        result = rollout(
            lambda memory, a, w: self.react(memory, a, w, q),
            self.begin(theta, omega, q),
            theta,
            omega,
            steps * self.substeps,
            period / self.substeps,
            self.method,
        )
        a, w, k = (x[..., :: self.substeps] for x in result)
        return a, w, k
