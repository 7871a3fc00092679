"""Geometry of the cam: golden table, derivatives, properties."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.cam_follower.cam import TURN, Cam, cycloid
from pipeline.cam_follower.cam_follower import CamFollower
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
