"""The cam and its mechanism: golden table, geometry, energy, force, and all generated forms."""

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from pipeline.cam_follower import cam_follower as physics
from pipeline.cam_follower.cam import TURN, Cam, cycloid
from pipeline.cam_follower.cam_follower import CamFollower
from pipeline.cam_follower.integrate import rollout
from pipeline.cam_follower.kernels import compiled_function, numpy_function, torch_function
from pipeline.chapters.summary import table_5_1

strokes = st.floats(0.005, 0.05)
skews = st.floats(0.6 * np.pi, 1.4 * np.pi)


def test_table_5_1_all_forty_cells() -> None:
    """Tables 5.1a and 5.1b of the dissertation, exact as printed."""
    cells = table_5_1(lambda H, beta: CamFollower().cam(H, beta).extremes())
    assert len(cells) == 40
    wrong = cells[cells["ours"] != cells["dissertation"]]
    assert wrong.empty, wrong.to_string()


@given(strokes, skews)
def test_cycloid_rises_to_its_stroke_and_is_smooth(H: float, beta: float) -> None:
    h, d, dd, _ = cycloid(np.array([0.0, beta, TURN - 1e-12]), H, beta)
    np.testing.assert_allclose(h, [0.0, H, 0.0], atol=1e-12)
    np.testing.assert_allclose(d, 0.0, atol=1e-9)
    np.testing.assert_allclose(dd, 0.0, atol=1e-9)


@given(strokes, skews)
def test_cycloid_derivatives_match_central_differences(H: float, beta: float) -> None:
    phi = np.linspace(0.05, beta - 0.05, 50)
    step = 1e-5
    low, high = cycloid(phi - step, H, beta), cycloid(phi + step, H, beta)
    centre = cycloid(phi, H, beta)
    for k in range(3):
        np.testing.assert_allclose((high[k] - low[k]) / (2 * step), centre[k + 1], rtol=1e-6, atol=1e-8)


@pytest.mark.long
@given(strokes, skews)
def test_pitch_curve_stays_within_the_stroke_and_differentiates(H: float, beta: float) -> None:
    cam = Cam(H, beta)
    h, d, dd = cam.pitch_curve(7200)
    assert h.min() >= -1e-12
    assert h.max() <= H + 1e-12
    np.testing.assert_allclose(h.max(), H, rtol=1e-4)
    if not cam.undercut:
        step = TURN / 7200
        np.testing.assert_allclose((np.roll(h, -1) - np.roll(h, 1)) / (2 * step), d, atol=2e-4 * H)
        np.testing.assert_allclose(d.sum() * step, 0.0, atol=1e-9)
        np.testing.assert_allclose(np.sort(dd)[[0, -1]], np.sort(np.gradient(d, step))[[0, -1]], rtol=0.05)


def test_a_point_follower_sees_the_cycloid_itself() -> None:
    cam = Cam(0.05, np.pi, roller_radius=0.0)
    np.testing.assert_allclose(cam.pitch_curve(720), cam.theoretical_curve(720), atol=1e-7)


@pytest.mark.parametrize(
    ("H", "beta", "undercut"), [(0.07, 0.5, True), (0.07, 1.5, True), (0.07, 1.0, False)]
)
def test_undercut_cams_are_found(H: float, beta: float, undercut: bool) -> None:
    cam = Cam(H, beta * np.pi)
    assert cam.undercut is undercut
    assert np.isfinite(cam.pitch_curve()).all()


def test_the_roller_is_never_inside_the_cam() -> None:
    """The distance from its centre to the perimeter is the roller's radius, also on an undercut cam."""
    cam = Cam(0.07, 1.5 * np.pi)
    grid = np.arange(0, 3600, 40)
    radius = cam.pitch_curve(3600)[0][grid] + cam.prime_radius
    angle = grid * TURN / 3600
    phi = np.linspace(0, TURN, 20_001)
    r = cam.base_radius + cycloid(phi, cam.H, cam.beta)[0]
    centre, perimeter = radius * np.exp(1j * angle), r * np.exp(1j * phi)
    distance = np.abs(centre[:, None] - perimeter[None, :]).min(axis=1)
    np.testing.assert_allclose(distance, cam.roller_radius, rtol=2e-4)


def test_area_moments_of_a_disc() -> None:
    polar, x, y = Cam(1e-12, np.pi).area_moments
    np.testing.assert_allclose(polar, np.pi * 0.02**4 / 2, rtol=1e-9)
    np.testing.assert_allclose([x, y], 0.0, atol=1e-12)


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
    symbols = physics.T_d, physics.omega, physics.dh, physics.d2h, physics.m, physics.J
    equation = torch_function(physics.ACCELERATION, (*symbols, *physics.CONSTANTS))

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
    speed, arguments = physics.follower_speed, (physics.omega, physics.dh, *physics.CONSTANTS)
    friction = numpy_function(physics.guide_friction(speed, physics.sp.sign(speed)), arguments)
    assert (friction(omega, dh, *CamFollower().constants) * dh * omega >= 0).all()
    arguments = (physics.omega, physics.V, *physics.MOTOR_PARAMETERS[1:])
    torque = numpy_function(physics.MOTOR_TORQUE, arguments)(omega, 0.0, 0.3, 0.08, 0.8, 0.2, 5.0)
    assert (torque * omega <= 0).all()
