"""Models of a DC-motor drivetrain, without a network and with a network on top."""

import torch
from torch import Generator, Tensor, nn

from pipeline.cam_follower import cam_follower as physics
from pipeline.cam_follower.conditions import Bench, Conditions
from pipeline.cam_follower.dynamics import Dynamics
from pipeline.cam_follower.kernels import torch_function
from pipeline.cam_follower.relu_ode import ReluNetwork, cam_inputs


class Motor(Dynamics):
    """Known physics: motor, friction of the gearbox, cam plate and follower.

    Args:
        bench: mechanism and cams.
        batch: number of models.
        curve: "pitch" or "theoretical" cam curve; default "pitch".

    Attributes:
        parameters_: parameters J (kg m^2), k_V (N m/V), k_omega (N m s/rad), T_c and T_s (N m), omega_s
            (rad/s), shape (batch, 6).
    """

    method = "rk4"
    substeps = 2

    def __init__(self, bench: Bench, batch: int, curve: str = "pitch") -> None:
        super().__init__(bench, batch, curve)
        self.parameters_ = nn.Parameter(torch.ones(batch, 6), requires_grad=False)
        self.constants = bench.mechanism.constants
        symbols = (physics.T_d, physics.theta, physics.omega, physics.dh, physics.d2h, physics.m, physics.V)
        self._equation = torch_function(
            physics.MOTOR_ACCELERATION,
            (*symbols, *physics.CAM_CONSTANTS, *physics.MOTOR_PARAMETERS, *physics.CONSTANTS),
        )

    def effort(self, omega: Tensor, dh: Tensor, d2h: Tensor, q: Conditions) -> Tensor:
        """Return the torque on the shaft that the physics does not contain: zero for this model.

        Args:
            omega: speed of the cam, rad/s, shape (batch, runs).
            dh: first derivative of the displacement, m/rad, shape (batch, runs).
            d2h: second derivative of the displacement, m/rad^2, shape (batch, runs).
            q: operating points, each of shape (runs,) or (batch, runs).

        Returns:
            Torque, N m, shape (batch, runs).
        """
        return torch.zeros_like(omega)

    def acceleration(self, theta: Tensor, omega: Tensor, q: Conditions) -> Tensor:
        dh, d2h = self.cams(q.cam, theta)
        torque = self.effort(omega, dh, d2h, q)
        own = (q.J_c, q.S_x, q.S_y)
        parameters = (p[:, None] for p in self.parameters_.unbind(1))
        result: Tensor = self._equation(
            torque, theta, omega, dh, d2h, q.m, q.V, *own, *parameters, *self.constants
        )
        return result


class MotorHybrid(Motor):
    """The motor drivetrain with a network as an additional torque on the shaft.

    Args:
        bench: mechanism and cams.
        scale: standard deviation of every input over the training data, shape (batch, 7).
        generator: random generator of the initial weights.
        hidden: number of hidden units.
        curve: "pitch" or "theoretical" cam curve; default "pitch".
    """

    #: Scale of the network's torque, N m: what separates two assemblies of the bench.
    OUTPUT = 0.1

    def __init__(
        self, bench: Bench, scale: Tensor, generator: Generator, hidden: int, curve: str = "pitch"
    ) -> None:
        super().__init__(bench, len(scale), curve)
        self.network = ReluNetwork(scale, hidden, generator)
        # the network starts silent: training starts from the identified physics
        self.network.W_o.data.zero_()

    def inputs(self, theta: Tensor, omega: Tensor, q: Conditions) -> Tensor:
        dh, d2h = self.cams(q.cam, theta)
        return self._inputs(dh, d2h, omega, q)

    @staticmethod
    def _inputs(dh: Tensor, d2h: Tensor, omega: Tensor, q: Conditions) -> Tensor:
        """(..., 7): what the soft hybrid sees, and the cam's parameters, which stand for its assembly."""
        return torch.cat(
            [cam_inputs(dh, d2h, omega, q), torch.stack([q.H, q.beta], -1).expand(*dh.shape, 2)], -1
        )

    def effort(self, omega: Tensor, dh: Tensor, d2h: Tensor, q: Conditions) -> Tensor:
        output: Tensor = self.network(self._inputs(dh, d2h, omega, q))
        return output * self.OUTPUT
