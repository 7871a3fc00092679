"""Linear least squares on the inputs of the black-box model: the baseline of section 6.4.5."""

import torch
from torch import Tensor, nn

from pipeline.cam_follower.conditions import Bench, Conditions
from pipeline.cam_follower.dynamics import Dynamics, raw_inputs


class Linear(Dynamics):
    """Acceleration as an affine function of the inputs of f_BB.

    Args:
        bench: mechanism and cams.
        batch: number of models.
    """

    def __init__(self, bench: Bench, batch: int) -> None:
        super().__init__(bench, batch, "theoretical")
        self.weights = nn.Parameter(torch.zeros(batch, 8, 1), requires_grad=False)

    def inputs(self, theta: Tensor, omega: Tensor, q: Conditions) -> Tensor:
        inputs = raw_inputs(theta, omega, q)
        return torch.cat([inputs, torch.ones_like(inputs[..., :1])], -1)

    def acceleration(self, theta: Tensor, omega: Tensor, q: Conditions) -> Tensor:
        return (self.inputs(theta, omega, q) @ self.weights)[..., 0]
