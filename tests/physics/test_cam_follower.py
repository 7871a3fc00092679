"""Equations of the mechanism: energy, force, and every generated form against the others."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from pipeline.cam_follower import cam_follower as physics
from pipeline.cam_follower.cam import cycloid
from pipeline.cam_follower.cam_follower import CamFollower
from pipeline.cam_follower.integrate import rollout
from pipeline.cam_follower.kernels import compiled_function, numpy_function, torch_function

SYMBOLS = (physics.T_d, physics.theta, physics.omega, physics.dh, physics.d2h, physics.m, physics.V)
ALL = (*SYMBOLS, *physics.CAM_CONSTANTS, *physics.MOTOR_PARAMETERS, *physics.CONSTANTS)


def test_contact_force_is_newtons_law_on_the_follower() -> None:
    """F = m (y'' + g) + F_b with y on the cam, eq. 5.2, differentiated numerically."""
    H, beta, m, rate = 0.03, np.pi, 1.1, 15.0
    t = np.linspace(0.02, 0.3, 4001)
    step = t[1] - t[0]
    theta = rate * t + 2.0 * t**2
    y = cycloid(theta, H, beta)[0]
    speed, acceleration = np.gradient(y, step), np.gradient(np.gradient(y, step), step)
    expected = m * (acceleration + 9.81) + 0.5 * np.sign(speed) + 12.0 * speed
    _, d, dd, _ = cycloid(theta, H, beta)
    arguments = (physics.omega, physics.alpha, physics.dh, physics.d2h, physics.m, *physics.CONSTANTS)
    force = numpy_function(physics.INTERFACE_FORCE, arguments)
    ours = force(rate + 4.0 * t, 4.0, d, dd, m, *CamFollower().constants)
    inner = (np.abs(speed) > 0.01) & (t > 0.03) & (t < 0.29)
    np.testing.assert_allclose(ours[inner], expected[inner], rtol=2e-4, atol=2e-3)


@pytest.mark.long
def test_energy_is_conserved_without_dissipation() -> None:
    """1/2 (J + m h'^2) omega^2 + m g h is constant when nothing drives, brakes or rubs."""
    J, m, H, beta = 0.01, 1.0, 0.01, np.pi
    arguments = (
        physics.T_d,
        physics.omega,
        physics.dh,
        physics.d2h,
        physics.m,
        physics.J,
        *physics.CONSTANTS,
    )
    equation = torch_function(physics.ACCELERATION, arguments)

    def curve(theta: torch.Tensor) -> list[torch.Tensor]:
        return [torch.as_tensor(x) for x in cycloid(theta.numpy(), H, beta)[:3]]

    def acceleration(theta: torch.Tensor, omega: torch.Tensor) -> torch.Tensor:
        _, dh, d2h = curve(theta)
        return equation(torch.zeros_like(omega), omega, dh, d2h, m, J, 9.81, 0.0, 0.0)

    start = torch.zeros(1, dtype=torch.float64), torch.full((1,), 20.0, dtype=torch.float64)
    theta, omega, _ = rollout(
        lambda memory, a, w: (acceleration(a, w), memory), torch.empty(0), *start, 2000, 5e-4, "rk4"
    )
    h, dh, _ = curve(theta)
    energy = 0.5 * (J + m * dh**2) * omega**2 + m * 9.81 * h
    np.testing.assert_allclose(energy.numpy(), float(energy[0, 0]), rtol=1e-7)


def test_numpy_torch_and_compiled_forms_agree() -> None:
    generator = np.random.default_rng(0)
    values = generator.uniform(0.1, 2.0, (len(ALL), 20)) * generator.choice([-1.0, 1.0], (len(ALL), 20))
    values[len(SYMBOLS) + 3 : len(SYMBOLS) + 9] = np.abs(values[len(SYMBOLS) + 3 : len(SYMBOLS) + 9])
    expected = numpy_function(physics.MOTOR_ACCELERATION, ALL)(*values)
    got = torch_function(physics.MOTOR_ACCELERATION, ALL)(*torch.tensor(values)).numpy()
    np.testing.assert_allclose(got, expected, rtol=1e-12)
    scalar = compiled_function(physics.MOTOR_ACCELERATION, ALL)
    np.testing.assert_allclose([scalar(*column) for column in values.T], expected, rtol=1e-12)


def test_gradient_of_the_drivetrain() -> None:
    generator = torch.Generator().manual_seed(0)
    values = [torch.rand(3, generator=generator, dtype=torch.float64) + 0.5 for _ in ALL]
    values = [v.requires_grad_() for v in values]
    assert torch.autograd.gradcheck(torch_function(physics.MOTOR_ACCELERATION, ALL), values)


def test_friction_never_adds_power() -> None:
    """The guide and the gearbox take power out of the shaft in both directions."""
    generator = np.random.default_rng(1)
    omega, dh = generator.uniform(-30, 30, 500), generator.uniform(-0.05, 0.05, 500)
    follower = numpy_function(
        physics.guide_friction(physics.follower_speed, physics.sp.sign(physics.follower_speed)),
        (physics.omega, physics.dh, *physics.CONSTANTS),
    )(omega, dh, *CamFollower().constants)
    assert (follower * dh * omega >= 0).all()
    arguments = (physics.omega, physics.V, *physics.MOTOR_PARAMETERS[1:])
    torque = numpy_function(physics.MOTOR_TORQUE, arguments)(omega, 0.0, 0.3, 0.08, 0.8, 0.2, 5.0)
    assert (torque * omega <= 0).all()
