"""How fits proceed: derivatives, eliminated starts, bounds, divergence and step sizes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.diagnosis.benches import Bench, integrated
from tests.diagnosis.unknowns import F_C, MGL, B, simulation_of
from unmodelled.diagnosis.fitting.deviation import gap, substeps_needed
from unmodelled.diagnosis.fitting.fit import fit_parameters
from unmodelled.diagnosis.fitting.floor import start_noise
from unmodelled.diagnosis.fitting.normal_equations import NormalEquations
from unmodelled.diagnosis.fitting.residuals import Errors
from unmodelled.diagnosis.fitting.unknowns import Unknown, Unknowns

Array = NDArray[np.float64]


def test_derivatives_against_an_independent_integration(tmp_path: Path) -> None:
    bench = Bench(runs=1, samples=120)
    simulation = simulation_of(tmp_path, bench)
    unknowns = Unknowns(simulation, (B, MGL, F_C))
    recording = simulation.recording
    sigma = start_noise(simulation, unknowns.numbers(unknowns.vector({})[None]))
    errors = Errors(unknowns, sigma, 4)
    z, moved = unknowns.vector({"b": 0.02, "mgl": 1.1, "F_c": 0.05}), np.full(sigma.shape, 0.3)
    around = errors(*errors.around(z, moved))
    r, slopes = around[:, 0], errors.slopes(z, around)
    u, order = recording.logs.u, np.argsort(recording.start)
    for w in order[:2]:
        rows = slice(recording.start[w], recording.start[w] + recording.steps[w] + 1)
        shown = recording.logs.y[rows, 0]
        velocity = recording.sensors.slope(0, 0.0)[recording.start[w]]
        x0 = np.array([shown[0], velocity]) + moved[w] * sigma[w]

        def residual(point: Array, rows=rows, shown=shown, x0=x0, w=w) -> Array:  # type: ignore[no-untyped-def]
            b, mgl, friction = point[:3] * unknowns.scale
            truth = replace(bench, b=b, mgl=mgl, friction=friction)
            start = (x0 + point[3:] * sigma[w])[:, None]
            path = integrated(truth.rates, start, u[rows], substeps=4)[:, 0, 0]
            return (path - shown)[1:] / recording.noise[0]

        steps = recording.steps[w]
        point = np.concatenate([z, np.zeros(2)])
        np.testing.assert_allclose(r[w, :steps, 0], residual(point), atol=1e-6 * np.abs(r).max())
        for k in range(5):
            step = 1e-4 * np.eye(5)[k]
            expected = (residual(point + step) - residual(point - step)) / 2e-4
            largest = np.abs(expected).max()
            np.testing.assert_allclose(slopes[w, k, :steps, 0], expected, atol=1e-2 * largest)


def test_starts_are_eliminated_as_if_all_were_solved_together() -> None:
    rng = np.random.default_rng(0)
    windows, samples, each, states = 4, 9, 2, 2
    r, moved = rng.normal(size=(windows, samples, 1)), rng.normal(size=(windows, states))
    slopes = rng.normal(size=(windows, each + states, samples, 1))
    weight = rng.uniform(0.5, 2.0, r.shape)
    entry = np.stack([np.zeros(windows, np.int64), 1 + np.arange(windows) // 2], axis=1)
    prior, here = np.array([0.0, 2.0, 0.0]), np.array([0.3, -0.7, 0.1])
    normal = NormalEquations.of(r, slopes, weight, moved, entry, prior)
    free = np.full(3, np.inf)
    there, moves = normal.step(0.0, here, (-free, free))
    rows, right = [], []
    for w in range(windows):
        full = np.zeros((samples + states, 3 + windows * states))
        root, own = np.sqrt(weight[w]), 3 + w * states + np.arange(states)
        full[:samples, entry[w]] = root * slopes[w, :each, :, 0].T
        full[:samples, own] = root * slopes[w, each:, :, 0].T
        full[samples:, own] = np.eye(states)
        rows.append(full)
        right.append(np.concatenate([root[:, 0] * r[w, :, 0], moved[w]]))
    rows.append(np.sqrt(2.0) * np.eye(3 + windows * states)[[1]])
    right.append(np.sqrt(2.0) * here[[1]])
    solution = -np.linalg.lstsq(np.concatenate(rows), np.concatenate(right), rcond=None)[0]
    np.testing.assert_allclose(there, here + solution[:3], rtol=1e-9)
    np.testing.assert_allclose(moves.ravel(), solution[3:], rtol=1e-9)


def test_fits_are_deterministic(tmp_path: Path) -> None:
    simulation = simulation_of(tmp_path, Bench(samples=200))
    first, second = (fit_parameters(simulation, starts=[{}, {"mgl": 2.0}]) for _ in range(2))
    assert first.values == second.values and first.loss == second.loss
    np.testing.assert_array_equal(first.covariance, second.covariance)
    np.testing.assert_array_equal(first.start, second.start)
    assert first.simulations == second.simulations > 0


def test_bounds_hold(tmp_path: Path) -> None:
    simulation = simulation_of(tmp_path, Bench())
    tight = [replace(B, low=0.02), MGL, replace(F_C, high=0.04)]
    found = fit_parameters(simulation, tight)
    assert found.converged
    assert found.values["b"] == 0.02 and found.values["F_c"] == pytest.approx(0.04, rel=1e-12)
    assert found.values["mgl"] == pytest.approx(1.2, rel=0.02)
    outside = fit_parameters(simulation, [replace(B, low=0.05, high=0.08)], starts=[{"b": 0.5}], iterations=3)
    assert 0.05 <= outside.values["b"] <= 0.08


def test_divergence_is_a_large_error(tmp_path: Path) -> None:
    """A gain that makes every window blow up at the start of the fit is left behind, or owned up to."""
    change = ("mgl*sin(theta)", "mgl*sin(theta) - grow*omega**3")
    number = ("ports:", "  grow: {value: 0.0, unit: N m s^3/rad^3}\nports:")
    simulation = simulation_of(tmp_path, Bench(), change, number)
    growing = Unknown("grow", -10.0, 10.0, 0.1)
    values = np.tile(simulation.values, (1, 2, 1))
    values[0, 1, simulation.names.index("grow")] = 10.0
    runs = simulation(values)
    assert not runs.diverged[:, 0].any() and runs.diverged[:, 1].mean() > 0.5
    assert gap(simulation, values[:, 1:]).value > 5.0
    lost = fit_parameters(simulation, [growing], starts=[{"grow": 10.0, "b": 0.015}], iterations=3)
    assert np.isfinite(lost.loss) and np.isfinite(lost.gap.value)
    assert not lost.converged or lost.gap.value < 1.0
    found = fit_parameters(simulation, [B, MGL, F_C, growing], starts=[{"grow": 10.0}, {"grow": 0.0}])
    assert found.values["mgl"] == pytest.approx(1.2, rel=0.01)


def test_steps_are_as_small_as_noise_asks_for(tmp_path: Path) -> None:
    simulation = simulation_of(tmp_path, Bench())
    values = simulation.values[None, None]
    assert substeps_needed(simulation, values)[0] == 1
    stiff = values.copy()
    stiff[..., simulation.names.index("creep")] = 2e-4
    stiff[..., simulation.names.index("F_c")] = 0.06
    assert substeps_needed(simulation, stiff)[0] > 1
    assert fit_parameters(simulation, [MGL], iterations=1).substeps == 1


def test_a_fit_may_end_where_an_iteration_gains_little(tmp_path: Path) -> None:
    simulation = simulation_of(tmp_path, Bench(runs=2, samples=200))
    exact, near = (fit_parameters(simulation, [B, MGL, F_C], share=share) for share in (1e-9, 0.9))
    assert near.converged and near.simulations < exact.simulations
    assert exact.left.value <= near.left.value < 1.2 * exact.left.value
