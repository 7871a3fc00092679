"""What every model of the drivetrain has in common."""

from __future__ import annotations

from abc import ABC, abstractmethod

import torch
from torch import Tensor, nn

from pipeline.cam_follower.conditions import Bench, CamTable, Conditions
from pipeline.cam_follower.integrate import Method, rollout


class Dynamics(nn.Module, ABC):
    """A stack of `batch` independently fitted models of the shaft's acceleration.

    Attributes:
        method: integrator of the free-run simulation. substeps: its steps per sampling period.
    """

    method: Method = "euler"
    substeps: int = 1

    def __init__(self, bench: Bench, batch: int, curve: str) -> None:
        super().__init__()
        self.batch = batch
        self.cams = CamTable(torch.tensor(bench.curves(curve), dtype=torch.float32))

    @abstractmethod
    def acceleration(self, theta: Tensor, omega: Tensor, q: Conditions) -> Tensor:
        """Angular acceleration, rad/s^2.

        Args:
            theta, omega: (batch, runs) state, rad and rad/s.
            q: conditions, (batch, runs) or (runs,).

        Returns:
            (batch, runs).
        """

    @torch.no_grad()
    def simulate(
        self, theta: Tensor, omega: Tensor, q: Conditions, steps: int, period: float
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Free-run simulation from the initial state (batch, runs).

        Returns:
            Angle (rad), speed (rad/s), acceleration (rad/s^2) at every period, (batch, runs, steps + 1).
        """
        result = rollout(
            lambda a, w: self.acceleration(a, w, q),
            theta,
            omega,
            steps * self.substeps,
            period / self.substeps,
            self.method,
        )
        a, w, k = (x[..., :: self.substeps] for x in result)
        return a, w, k
