"""Resampling and integration."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from pipeline.cam_follower.integrate import SPEED_LIMIT, rollout
from unmodelled.logs.resample import resample


@given(st.floats(0.5, 15.0))
def test_slow_signals_survive_resampling(frequency: float) -> None:
    t = np.arange(0, 2.0, 0.0005)
    signal = np.sin(2 * np.pi * frequency * t)
    new, (slow,) = resample(t, signal[None], 0.01)
    inner = slice(20, -20)
    np.testing.assert_allclose(slow[inner], np.sin(2 * np.pi * frequency * new)[inner], atol=0.02)


def test_fast_signals_do_not_alias() -> None:
    t = np.arange(0, 2.0, 0.0005)
    _, (slow,) = resample(t, np.sin(2 * np.pi * 190.0 * t)[None], 0.01)
    assert np.abs(slow[20:-20]).max() < 0.01


def test_a_straight_line_stays_straight_in_spite_of_jitter() -> None:
    generator = np.random.default_rng(0)
    t = np.arange(4000) * 0.0005 + generator.uniform(-5e-5, 5e-5, 4000)
    new, (line,) = resample(t, (3.0 * t)[None], 0.01)
    np.testing.assert_allclose(line, 3.0 * new, atol=1e-3)


def test_upsampling_is_refused() -> None:
    with pytest.raises(ValueError, match="must be longer"):
        resample(np.arange(100) * 0.01, np.zeros((1, 100)), 0.001)


@pytest.mark.parametrize(("method", "order"), [("euler", 1), ("rk4", 4)])
def test_order_of_convergence(method: str, order: int) -> None:
    """Harmonic oscillator over one second against cos."""

    def error(steps: int) -> float:
        start = torch.ones(1, dtype=torch.float64), torch.zeros(1, dtype=torch.float64)
        angle, _, _ = rollout(
            lambda memory, a, w: (-4.0 * a, memory), torch.empty(0), *start, steps, 1.0 / steps, method
        )  # type: ignore[arg-type]
        return abs(float(angle[0, -1]) - float(np.cos(2.0)))

    rate = np.log2(error(100) / error(200))
    assert rate == pytest.approx(order, abs=0.15)


def test_divergence_stays_finite() -> None:
    start = torch.ones(2), torch.ones(2)
    _, omega, _ = rollout(lambda memory, a, w: (w**3, memory), torch.empty(0), *start, 200, 0.1, "euler")
    assert torch.isfinite(omega).all()
    assert float(omega.abs().max()) <= SPEED_LIMIT
