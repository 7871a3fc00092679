"""The two-parameter efficiency of a motor is the balance of its powers."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.cam_follower.static import efficiency


@pytest.mark.parametrize("constant", [0.4, 1.25])
def test_it_is_power_out_by_power_in_whatever_the_motor_constant(constant: float) -> None:
    current, voltage, resistance, friction = np.array([2.0, 8.0, 15.0]), 200.0, 2.5, 0.006
    emf = voltage - resistance * current
    speed = emf / constant
    torque = constant * current - friction * constant**2 * speed
    found = efficiency(current, voltage, resistance, friction)
    np.testing.assert_allclose(found, torque * speed / (voltage * current), rtol=1e-12)


def test_a_motor_without_losses_wastes_nothing() -> None:
    np.testing.assert_allclose(efficiency(np.array([4.0, 15.0]), 200.0, 0.0, 0.0), 1.0)


def test_by_hand() -> None:
    # E_a = 200 - 2 * 10 = 180 V, of 2000 W remain 180 * (10 - 0.006 * 180)
    assert efficiency(np.array([10.0]), 200.0, 2.0, 0.006)[0] == pytest.approx(0.8028, abs=1e-12)
