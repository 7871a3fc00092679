"""Resampling, integration, and smoothing differentiation against known derivatives and the best width."""

from collections.abc import Callable

import numpy as np
import pytest
import torch
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.signal import savgol_filter

from pipeline.cam_follower.integrate import SPEED_LIMIT, rollout
from pipeline.recordings.resample import resample
from unmodelled.base.arrays import Array
from unmodelled.logs.clock import delayed
from unmodelled.logs.differentiate import ORDER, filtered, noise, quantum, resolution, smooth_derivative


@given(st.floats(0.5, 15.0))
@example(190.0)
def test_slow_signals_survive_resampling_and_fast_ones_do_not_alias(frequency: float) -> None:
    t, inner = np.arange(0, 2.0, 0.0005), slice(20, -20)
    new, (found,) = resample(t, np.sin(2 * np.pi * frequency * t)[None], 0.01)
    if frequency == 190.0:
        assert np.abs(found[inner]).max() < 0.01
    else:
        np.testing.assert_allclose(found[inner], np.sin(2 * np.pi * frequency * new)[inner], atol=0.02)


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

    assert np.log2(error(100) / error(200)) == pytest.approx(order, abs=0.15)


def test_divergence_stays_finite() -> None:
    start = torch.ones(2), torch.ones(2)
    _, omega, _ = rollout(lambda memory, a, w: (w**3, memory), torch.empty(0), *start, 200, 0.1, "euler")
    assert torch.isfinite(omega).all()
    assert float(omega.abs().max()) <= SPEED_LIMIT


PERIOD = 0.001
COUNT = 2.0 * np.pi / 8192


def chirp(n: int, first: float, last: float, amplitude: float) -> tuple[Array, Array]:
    """Position and velocity, from `first` to `last` Hz."""
    t = np.arange(n) * PERIOD
    rate = (last - first) / (n * PERIOD)
    phase = 2.0 * np.pi * (first * t + 0.5 * rate * t * t)
    return amplitude * np.sin(phase), amplitude * np.cos(phase) * 2.0 * np.pi * (first + rate * t)


def stick_slip(n: int) -> tuple[Array, Array]:
    """Velocity with corners and standstills."""
    t = np.arange(n) * PERIOD
    v = np.maximum(0.0, np.abs((t / 2.0) % 1.0 - 0.5) * 4.0 - 0.5) * np.sign(np.sin(np.pi * t / 2.0))
    return np.cumsum(v) * PERIOD, v


def white(sigma: float) -> Callable[[Array], Array]:
    return lambda y: y + sigma * np.random.default_rng(0).standard_normal(len(y))


def encoder(counts: int) -> Callable[[Array], Array]:
    step = 2.0 * np.pi / counts
    return lambda y: step * np.round(y / step)


SIGNALS = {
    "slow": chirp(5_000, 0.2, 3.0, 1.0),
    "fast": chirp(5_000, 1.0, 20.0, 0.1),
    "crawl": chirp(10_000, 0.05, 0.2, 0.02),
    "stick-slip": stick_slip(10_000),
}
SENSORS = {str(sigma): white(sigma) for sigma in (1e-6, 1e-4, 1e-2)}
SENSORS |= {f"{counts} counts": encoder(counts) for counts in (8192, 500)}


def rms(x: Array) -> float:
    return float(np.sqrt(np.mean(x**2)))


@pytest.mark.parametrize("sensor", SENSORS)
@pytest.mark.parametrize("signal", SIGNALS)
def test_velocity_is_nearly_as_good_as_with_the_best_width(signal: str, sensor: str) -> None:
    position, velocity = SIGNALS[signal]
    y = SENSORS[sensor](position)
    _, found, width = smooth_derivative(y, np.array([0, len(y)]), PERIOD)
    widths = [w for w in range(5, 800, 6) if w <= len(y) // 2]
    inner = slice(100, -100)
    best = min(rms((savgol_filter(y, w, 3, 1, PERIOD) - velocity)[inner]) for w in widths)
    assert width % 2 == 1
    assert rms((found - velocity)[inner]) < 1.5 * best
    assert rms(found - velocity) < 4.0 * best


@pytest.mark.parametrize("sigma", [1e-6, 1e-4, 1e-2])
@pytest.mark.parametrize("signal", SIGNALS)
def test_white_noise_is_found(signal: str, sigma: float) -> None:
    assert noise(white(sigma)(SIGNALS[signal][0])) == pytest.approx(sigma, rel=0.1)


@pytest.mark.parametrize("counts", [8192, 500])
@pytest.mark.parametrize("signal", ["slow", "fast", "stick-slip"])
def test_quantisation_noise_is_found(signal: str, counts: int) -> None:
    y = encoder(counts)(SIGNALS[signal][0])
    assert noise(y) == pytest.approx(2.0 * np.pi / counts / 12**0.5, rel=0.15)


def test_the_quantum_survives_printed_digits_and_an_offset() -> None:
    y = np.round(encoder(8192)(SIGNALS["slow"][0]) + 100.0, 6)
    assert quantum(y) == pytest.approx(COUNT, rel=5e-3)
    assert quantum(white(1e-3)(SIGNALS["slow"][0])) == 0.0
    assert quantum(np.full(50, 2.0)) == 0.0


def resampled(y: Array) -> Array:
    """Logged by a clock that jitters, and read at even times."""
    t = np.arange(len(y)) * PERIOD
    jitter = 0.1 * PERIOD * np.random.default_rng(0).standard_normal(len(y))
    return np.interp(t, t + jitter, y)


PLATEAUS = {
    "as they are": lambda y: y,
    "far from zero": lambda y: y + 1e9,
    "resampled": resampled,
    "noisy": white(1e-6),
    "every fourth sample": lambda y: np.repeat(y[::4], 4),
    "printed": lambda y: np.round(y, 6),
}


@pytest.mark.parametrize("change", PLATEAUS)
def test_the_quantum_of_plateaus(change: str) -> None:
    y = PLATEAUS[change](encoder(8192)(SIGNALS["crawl"][0]))
    assert quantum(y) == pytest.approx(COUNT, rel=0.01)
    assert noise(y) >= quantum(y) / 12**0.5


@pytest.mark.parametrize("rest", [0.0, 1e-5])
def test_a_machine_that_goes_to_and_fro_between_two_stops_is_not_quantised(rest: float) -> None:
    t = np.arange(8_000) * PERIOD
    there = np.clip(5.0 * np.sin(2.0 * np.pi * 1.5 * t), -1.0, 1.0)
    assert quantum(white(rest)(there)) == 0.0


@pytest.mark.parametrize("signal", SIGNALS)
def test_what_is_smooth_has_no_quantum(signal: str) -> None:
    y = white(1e-6)(SIGNALS[signal][0])
    assert quantum(y) == quantum(resampled(y)) == 0.0


def test_the_resolution_is_the_smallest_quantum_of_all_experiments() -> None:
    y = encoder(500)(SIGNALS["slow"][0])
    still, step = np.full(300, 2.0), np.repeat([0.0, 1.0], 150)
    assert resolution([still, y, step]) == quantum(y) < quantum(step)
    assert resolution([still]) == 0.0


def test_a_constant_has_neither_noise_nor_velocity() -> None:
    y = np.full(200, 3.0)
    position, velocity, _ = smooth_derivative(y, np.array([0, 100, 200]), PERIOD)
    assert noise(y) == 0.0
    np.testing.assert_allclose(position, 3.0)
    np.testing.assert_allclose(velocity, 0.0, atol=1e-9)


def test_experiments_do_not_see_each_other() -> None:
    """A jump between two experiments is no motion, and one width serves both."""
    position, velocity = SIGNALS["slow"]
    y = white(1e-4)(np.concatenate([position, position + 50.0]))
    _, found, width = smooth_derivative(y, np.array([0, len(position), len(y)]), PERIOD)
    assert np.abs(found - np.tile(velocity, 2)).max() < 0.5
    one = savgol_filter(y[len(position) :], width, 3, 1, PERIOD)
    middle = slice(width, -width)
    np.testing.assert_allclose(found[len(position) :][middle], one[middle])


@settings(max_examples=25, deadline=None)
@given(st.lists(st.floats(-5.0, 5.0), min_size=4, max_size=4), st.integers(50, 300))
def test_cubics_are_exact_up_to_the_ends(coefficients: list[float], n: int) -> None:
    t = np.linspace(-1.0, 1.0, n)
    polynomial = np.polynomial.Polynomial(coefficients)
    position, velocity, _ = smooth_derivative(polynomial(t), np.array([0, n]), t[1] - t[0])
    np.testing.assert_allclose(position, polynomial(t), atol=1e-9)
    np.testing.assert_allclose(velocity, polynomial.deriv()(t), atol=1e-7)


@pytest.mark.parametrize("width", [5, 7, 51, 499])
@pytest.mark.parametrize("derivative", [0, 1])
def test_filter_is_that_of_scipy(width: int, derivative: int) -> None:
    y = np.cumsum(np.random.default_rng(0).standard_normal(500))
    expected = savgol_filter(y, width, ORDER, derivative, PERIOD)
    found = filtered(y, width, derivative, PERIOD)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("late", [0.0, 0.25, 1.0, -0.25, -1.0, 2.5, -2.5, 40.0, -40.5])
def test_delayed_samples_are_held_beyond_the_ends_of_experiments(late: float) -> None:
    offsets = np.array([0, 2, 3, 30])
    values = np.random.default_rng(0).standard_normal((30, 1))
    found = delayed(values, offsets, PERIOD, [late * PERIOD], "linear")
    for a, b in ((0, 2), (2, 3), (3, 30)):
        at = np.arange(b - a)
        expected = np.interp(at - late, at, values[a:b, 0])  # which holds the ends, too
        np.testing.assert_allclose(found[a:b, 0], expected, atol=1e-12)
